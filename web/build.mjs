// Bundles src/ into one HTML page that needs nothing else, with marks where the data and the replays go.
//
//   node build.mjs PAGE.html [PAGE.cc]
//
// PAGE.cc holds the same bytes for the C++ side (src/report/page.h).
import { readFileSync, writeFileSync, mkdirSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const web = dirname(fileURLToPath(import.meta.url));
const marks = ["/*DATA*/", "/*REPLAYS*/"];

async function bundle(entry) {
  const result = await build({
    entryPoints: [join(web, "src", entry)],
    bundle: true,
    minify: true,
    write: false,
    format: "iife",
    target: ["chrome111", "firefox113", "safari16.2"],
    charset: "utf8",
    legalComments: "none",
    logLevel: "warning",
    metafile: true,
  });
  return result.outputFiles[0].text.trim() + notices(Object.keys(result.metafile.inputs));
}

// The licences of the libraries among `inputs`, which have to go with every copy; packages under one text share it.
function notices(inputs) {
  const packages = new Set(inputs.flatMap((path) => /node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(path)?.[1] ?? []));
  const texts = new Map();
  for (const name of [...packages].sort()) {
    const text = readFileSync(join(web, "node_modules", name, "LICENSE"), "utf8").trim();
    texts.set(text, [...(texts.get(text) ?? []), name]);
  }
  return [...texts].map(([text, names]) => `\n/*! ${names.join(", ")}\n${text}\n*/`).join("");
}

// A text that ends its own element early would break the page; none of ours may hold one.
function insert(page, mark, text, closing) {
  if (text.toLowerCase().includes(closing)) throw new Error(`the bundle contains ${closing}`);
  const at = page.indexOf(mark);
  if (at < 0 || page.indexOf(mark, at + 1) >= 0) throw new Error(`the template needs exactly one ${mark}`);
  return page.slice(0, at) + text + page.slice(at + mark.length);
}

// C++ string literals of whole UTF-8 lines, cut so that no compiler's limit is met.
function cppText(text) {
  const bytes = Buffer.from(text, "utf8");
  const lines = [];
  let line = "";
  for (const byte of bytes) {
    // Octal escapes have a fixed length, so what follows cannot become part of them.
    if (byte === 0x22 || byte === 0x5c) line += "\\" + String.fromCharCode(byte);
    else if (byte >= 0x20 && byte < 0x7f && byte !== 0x3f) line += String.fromCharCode(byte);
    else line += "\\" + byte.toString(8).padStart(3, "0");
    if (line.length >= 4000) {
      lines.push(`    "${line}"`);
      line = "";
    }
  }
  lines.push(`    "${line}"`);
  return { code: lines.join("\n"), length: bytes.length };
}

function cppFile(page) {
  const [data, replays] = marks.map((mark) => page.indexOf(mark));
  const parts = {
    before: page.slice(0, data),
    between: page.slice(data + marks[0].length, replays),
    after: page.slice(replays + marks[1].length),
  };
  const functions = Object.entries(parts).map(([name, part]) => {
    const { code, length } = cppText(part);
    return `std::string_view report_page_${name}() {
  static constexpr std::string_view kText(
${code},
      ${length});
  return kText;
}
`;
  });
  return `// Made by web/build.mjs.
#include "report/page.h"

namespace assay {

${functions.join("\n")}
}  // namespace assay
`;
}

function write(file, text) {
  mkdirSync(dirname(file), { recursive: true });
  writeFileSync(file, text);
}

const [htmlFile, ccFile] = process.argv.slice(2);
if (!htmlFile) {
  console.error("usage: node build.mjs PAGE.html [PAGE.cc]");
  process.exit(2);
}
let page = readFileSync(join(web, "src", "template.html"), "utf8");
page = insert(page, "/*STYLE*/", await bundle("style.css"), "</style");
page = insert(page, "/*SCRIPT*/", await bundle("main.ts"), "</script");
for (const mark of marks) if (page.split(mark).length !== 2) throw new Error(`the page needs exactly one ${mark}`);
write(htmlFile, page);
if (ccFile) write(ccFile, cppFile(page));
