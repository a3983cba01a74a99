// Bundles src/ into one HTML page that needs nothing else, with a mark where the data goes.
//
//   node build.mjs PAGE.html [PAGE.cc]
//
// PAGE.cc holds the same bytes for the C++ side: assay::report_page_before() and report_page_after() the data.
import { readFileSync, writeFileSync, mkdirSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const web = dirname(fileURLToPath(import.meta.url));
const dataMark = "/*DATA*/";

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
  const at = page.indexOf(dataMark);
  const before = cppText(page.slice(0, at));
  const after = cppText(page.slice(at + dataMark.length));
  return `// Made by web/build.mjs.
#include "report/page.h"

namespace assay {

std::string_view report_page_before() {
  static constexpr std::string_view kText(
${before.code},
      ${before.length});
  return kText;
}

std::string_view report_page_after() {
  static constexpr std::string_view kText(
${after.code},
      ${after.length});
  return kText;
}

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
if (page.split(dataMark).length !== 2) throw new Error(`the page needs exactly one ${dataMark}`);
write(htmlFile, page);
if (ccFile) write(ccFile, cppFile(page));
