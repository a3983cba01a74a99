// Havok's WebAssembly in Node, driven over a socket: the other end is node.cc. Havok is instantiated as native.cc does it
// (the same exports with the same arguments), without the loader of its package.
//
//   node node_host.mjs HavokPhysics.wasm        commands on descriptor 0, replies on descriptor 1
//
// A command is its length (u32, little-endian as all), its kind (u8) and:
//   hello   names of the exports that calls will number, separated by newlines  -> versions of Node and V8
//   create                                                                      -> u32 instance
//   destroy u32 instance                                                        -> nothing
//   call    u32 instance, u8 export, arguments                                  -> u32 result, what it wrote
//   step    u32 instance, u64 world, f32 timestep, u32 count                    -> u32 result
// An argument is its kind (u8) and: a number of its size; for structures a size (u8) and, when it is read, its bytes; for an
// array a size (u32) and its bytes.
// A reply is its length (u32), a status (u8, 0: done, 1: failed) and the result or a message.
import { readFileSync, readSync, writeSync } from 'node:fs';

const HELLO = 0, CREATE = 1, DESTROY = 2, CALL = 3, STEP = 4;
const U32 = 0, U64 = 1, F32 = 2, IN = 3, OUT = 4, ARRAY = 5;
const SLOTS = 8, SLOT_SIZE = 64;
const PAGE = 65536;

let wasm;  // compiled when the first instance is made
let names = [];
const instances = new Map();
let lastInstance = 0;

function instantiate() {
  wasm ??= new WebAssembly.Module(readFileSync(process.argv[2]));
  let memory;
  const imports = {};
  // What describes the module's interface to JavaScript has nothing to do.
  for (const { module, name } of WebAssembly.Module.imports(wasm)) (imports[module] ??= {})[name] = () => 0;
  Object.assign(imports.env, {
    _abort_js() { throw new Error('Havok called abort()'); },
    _emscripten_get_now_is_monotonic: () => 1,
    emscripten_get_now: () => performance.now(),
    emscripten_get_heap_max: () => 2 ** 31,
    emscripten_resize_heap(wanted) {
      wanted >>>= 0;
      if (wanted <= memory.buffer.byteLength) return 1;
      const pages = Math.ceil(wanted / PAGE);
      for (const generous of [pages + Math.floor(pages / 5), pages]) {
        try {
          memory.grow(generous - memory.buffer.byteLength / PAGE);
          return 1;
        } catch { /* too large: try the next */ }
      }
      return 0;
    },
  });
  imports.wasi_snapshot_preview1.fd_write = (descriptor, vectors, count, written) => {
    const view = new DataView(memory.buffer);
    let total = 0;
    for (let i = 0; i < count; ++i) {
      const length = view.getUint32(vectors + 8 * i + 4, true);
      if (length > 0) writeSync(2, new Uint8Array(memory.buffer, view.getUint32(vectors + 8 * i, true), length));
      total += length;
    }
    view.setUint32(written, total, true);
    return 0;
  };
  const { exports } = new WebAssembly.Instance(wasm, imports);
  memory = exports.memory;
  exports.__wasm_call_ctors();
  exports.main(0, 0);
  const scratch = exports.malloc(SLOTS * SLOT_SIZE) >>> 0;
  if (scratch === 0) throw new Error("Havok's heap has no room");
  return { exports, memory, scratch };
}

function call(instance, name, command, at) {
  const numbers = [], written = [], arrays = [];
  while (at < command.length) {
    const kind = command.readUInt8(at++);
    const address = instance.scratch + numbers.length * SLOT_SIZE;
    if (kind === U32) {
      numbers.push(command.readUInt32LE(at));
      at += 4;
    } else if (kind === U64) {
      numbers.push(command.readBigUInt64LE(at));
      at += 8;
    } else if (kind === F32) {
      numbers.push(command.readFloatLE(at));
      at += 4;
    } else if (kind === ARRAY) {
      const size = command.readUInt32LE(at);
      at += 4;
      const array = instance.exports.malloc(size) >>> 0;
      if (array === 0) throw new Error("Havok's heap has no room");
      new Uint8Array(instance.memory.buffer).set(command.subarray(at, at + size), array);
      at += size;
      arrays.push(array);
      numbers.push(array);
    } else {
      const size = command.readUInt8(at++);
      if (kind === IN) {
        new Uint8Array(instance.memory.buffer).set(command.subarray(at, at + size), address);
        at += size;
      } else {
        written.push([address, size]);
      }
      numbers.push(address);
    }
  }
  const result = instance.exports[name](...numbers) >>> 0;
  for (const array of arrays) instance.exports.free(array);
  const parts = [u32(result)];
  for (const [address, size] of written) parts.push(Buffer.from(instance.memory.buffer.slice(address, address + size)));
  return Buffer.concat(parts);
}

function step({ exports }, world, timestep, count) {
  const stepWorld = exports.HP_World_Step;
  for (let i = 0; i < count; ++i) {
    const result = stepWorld(world, timestep);
    if (result !== 0) return u32(result >>> 0);
  }
  return u32(0);
}

function u32(number) {
  const buffer = Buffer.alloc(4);
  buffer.writeUInt32LE(number);
  return buffer;
}

function obey(command) {
  const kind = command.readUInt8(0);
  if (kind === HELLO) {
    names = command.toString('latin1', 1).split('\n');
    return Buffer.from(`Node ${process.versions.node}, V8 ${process.versions.v8}`);
  }
  if (kind === CREATE) {
    instances.set(++lastInstance, instantiate());
    return u32(lastInstance);
  }
  const instance = instances.get(command.readUInt32LE(1));
  if (kind === DESTROY) {
    instances.delete(command.readUInt32LE(1));
    return Buffer.alloc(0);
  }
  if (kind === CALL) return call(instance, names[command.readUInt8(5)], command, 6);
  if (kind === STEP) {
    return step(instance, command.readBigUInt64LE(5), command.readFloatLE(13), command.readUInt32LE(17));
  }
  throw new Error(`unknown command ${kind}`);
}

// False at the end of the stream, which is the order to end.
function readWhole(buffer) {
  for (let done = 0; done < buffer.length;) {
    const got = readSync(0, buffer, done, buffer.length - done);
    if (got === 0) return false;
    done += got;
  }
  return true;
}

function writeWhole(buffer) {
  for (let done = 0; done < buffer.length;) done += writeSync(1, buffer, done);
}

const length = Buffer.alloc(4);
while (readWhole(length)) {
  const command = Buffer.alloc(length.readUInt32LE());
  if (!readWhole(command)) break;
  let status = 0, reply;
  try {
    reply = obey(command);
  } catch (error) {
    status = 1;
    reply = Buffer.from(String(error?.message ?? error));
  }
  writeWhole(Buffer.concat([u32(reply.length + 1), Buffer.from([status]), reply]));
}
