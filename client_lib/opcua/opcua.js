// What is used of node-opcua. Its packages are CommonJS: an ES module finds their names by a default import alone.
import certificates from 'node-opcua-certificate-manager';
import dataValue from 'node-opcua-data-value';
import debug from 'node-opcua-debug';
import channel from 'node-opcua-secure-channel';
import server from 'node-opcua-server';
import statusCode from 'node-opcua-status-code';
import variant from 'node-opcua-variant';

export const {OPCUACertificateManager} = certificates;
export const {DataValue} = dataValue;
export const {MessageSecurityMode, SecurityPolicy} = channel;
export const {OPCUAServer} = server;
export const {StatusCodes} = statusCode;
debug.setLogLevel(debug.LogLevel.Error);  // it warns of what concerns its authors

export const {DataType, Variant, VariantArrayType} = variant;
