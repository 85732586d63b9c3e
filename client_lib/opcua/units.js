// Units of signals as OPC UA has them: EUInformation with the common code of UNECE Recommendation 20.
import {DataType} from './opcua.js';

const codes = {
  '%': ['P1', '%'], 'degC': ['CEL', '°C'], 'K': ['KEL', 'K'], 'J': ['JOU', 'J'], 'N': ['NEW', 'N'], 'N m': ['NU', 'N·m'], 'Pa': ['PAL', 'Pa'],
  'W': ['WTT', 'W'], 'deg': ['DD', '°'], 'deg/s': ['E96', '°/s'], 'kg': ['KGM', 'kg'], 'm': ['MTR', 'm'], 'mm': ['MMT', 'mm'],
  'm/s': ['MTS', 'm/s'], 'm/s^2': ['MSK', 'm/s²'], 'm^2': ['MTK', 'm²'], 'rad': ['C81', 'rad'], 'rad/s': ['2A', 'rad/s'], 's': ['SEC', 's'],
  'Hz': ['HTZ', 'Hz'], 'V': ['VLT', 'V'], 'A': ['AMP', 'A'],
};

// The number of a common code: its characters as the bytes of an integer (OPC 10000-8, 5.6.3).
export const unitId = (code) => [...code].reduce((sum, character) => 256 * sum + character.charCodeAt(0), 0);

// A structure of the standard as a value.
export const structure = (addressSpace, name, fields) => ({dataType: DataType.ExtensionObject, value: addressSpace.constructExtensionObject(addressSpace.findDataType(name), fields)});

// Fields of EUInformation. A unit without a common code has the id -1, as the standard asks.
export function euInformation(unit) {
  const [code, shown] = codes[unit] ?? [null, unit];
  return {namespaceUri: code ? 'http://www.opcfoundation.org/UA/units/un/cefact' : '', unitId: code ? unitId(code) : -1, displayName: {text: shown}, description: {text: unit}};
}
