// What a picture of a report says, kept in the PNG file itself.
const kKeyword = "Description";

// The words of the page's head, grid and question, in the order of the page.
export function shownWords(page) {
  return page.$$eval("#masthead, .grid-table, .picker", (nodes) => nodes.map((node) => node.textContent.replace(/\s+/g, " ").trim()).join("\n"));
}

const table = Uint32Array.from({ length: 256 }, (_, n) => {
  for (let k = 0; k < 8; k += 1) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
  return n;
});

function crc(bytes) {
  let value = 0xffffffff;
  for (const byte of bytes) value = table[(value ^ byte) & 255] ^ (value >>> 8);
  return (value ^ 0xffffffff) >>> 0;
}

function chunk(type, data) {
  const named = Buffer.concat([Buffer.from(type, "latin1"), data]);
  const [length, check] = [Buffer.alloc(4), Buffer.alloc(4)];
  length.writeUInt32BE(data.length);
  check.writeUInt32BE(crc(named));
  return Buffer.concat([length, named, check]);
}

// [type, data, where it ends] of each chunk.
function* chunks(png) {
  for (let at = 8; at < png.length; ) {
    const end = at + 12 + png.readUInt32BE(at);
    yield [png.toString("latin1", at + 4, at + 8), png.subarray(at + 8, end - 4), end];
    at = end;
  }
}

// iTXt: keyword, not compressed, no language, no translated keyword, UTF-8 text.
export function withDescription(png, text) {
  const [[, , head]] = chunks(png); // IHDR is the first
  return Buffer.concat([png.subarray(0, head), chunk("iTXt", Buffer.from(`${kKeyword}\0\0\0\0\0${text}`)), png.subarray(head)]);
}

export function descriptionOf(png) {
  for (const [type, data] of chunks(png)) {
    const text = data.toString("utf8");
    if (type === "iTXt" && text.startsWith(`${kKeyword}\0`)) return text.slice(kKeyword.length + 5);
  }
  return "";
}
