// Starts headless Chromium the way the tests and the screenshots need it.
import { existsSync } from "node:fs";
import puppeteer from "puppeteer-core";

const known = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];

// `webgl` for pages with replays. Without a graphics card a library draws for WebGL, and would draw all of every page, too, which
// takes a multiple of the page's own time: so pages are put together without it.
export function launch({ webgl = false } = {}) {
  const executablePath = process.env.CHROMIUM ?? known.find((path) => existsSync(path));
  if (!executablePath) throw new Error("no Chromium found; name one in the environment variable CHROMIUM");
  return puppeteer.launch({
    executablePath,
    headless: true,
    args: [
      "--no-sandbox", // root in containers
      "--disable-dev-shm-usage",
      ...(webgl ? ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-rasterization"] : ["--disable-gpu"]),
      "--force-color-profile=srgb",
    ],
  });
}
