// Clients of npm against takt-modbus: modbus_node.js PORT modbus-serial|jsmodbus. Prints JSON.
'use strict';
const net = require('net');
const [port, name] = [Number(process.argv[2]), process.argv[3]];

async function modbusSerial() {
  const ModbusRTU = require('modbus-serial');
  const client = new ModbusRTU();
  await client.connectTCP('127.0.0.1', {port});
  client.setID(1);
  client.setTimeout(30000);
  const results = {};
  await client.writeCoil(0, true);
  results.coil = (await client.readCoils(0, 1)).data[0];
  await client.writeRegisters(0, [20]);
  results.holding = (await client.readHoldingRegisters(0, 1)).data;
  results.inputs = (await client.readDiscreteInputs(0, 2)).data.length >= 2;
  results.input = (await client.readInputRegisters(0, 4)).data.length;
  results.tooWide = await client.writeRegisters(0, [60000]).then(() => 0, error => error.modbusCode);
  results.beyond = await client.readInputRegisters(60000, 2).then(() => 0, error => error.modbusCode);
  client.close(() => {});
  return results;
}

function jsmodbus() {
  const Modbus = require('jsmodbus');
  const socket = new net.Socket();
  const client = new Modbus.client.TCP(socket, 1, 30000);
  return new Promise((resolve, reject) => {
    socket.on('error', reject);
    socket.on('connect', async () => {
      try {
        const results = {};
        await client.writeSingleCoil(0, true);
        results.coil = (await client.readCoils(0, 1)).response.body.valuesAsArray[0] === 1;
        await client.writeMultipleRegisters(0, [20]);
        results.holding = (await client.readHoldingRegisters(0, 1)).response.body.valuesAsArray;
        results.inputs = (await client.readDiscreteInputs(0, 2)).response.body.valuesAsArray.length >= 2;
        results.input = (await client.readInputRegisters(0, 4)).response.body.valuesAsArray.length;
        const code = error => error.response ? error.response.body.code : -1;
        results.tooWide = await client.writeMultipleRegisters(0, [60000]).then(() => 0, code);
        results.beyond = await client.readInputRegisters(60000, 2).then(() => 0, code);
        socket.end();
        resolve(results);
      } catch (error) {
        reject(error);
      }
    });
    socket.connect({host: '127.0.0.1', port});
  });
}

({'modbus-serial': modbusSerial, jsmodbus})[name]().then(
    results => {
      console.log(JSON.stringify(results));
      process.exit(0);
    },
    error => {
      console.error(error);
      process.exit(1);
    });
