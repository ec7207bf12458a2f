// The demo's report in a real browser: no complaints and no requests, accessible, readable on a narrow screen, and printed to PDF.
//   node page.mjs REPORT_HTML OUT_DIR
// Exit code 77: skipped, because there is no chromium.
import assert from "node:assert/strict";
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

const [report, out] = process.argv.slice(2);
const require = createRequire(join(process.env.LBEA_NODE_MODULES ?? process.cwd(), "page.mjs"));
const url = pathToFileURL(report).href;

/// What an engineer looks for; in the order of the page.
const sections = ["Verdict", "End", "Frames", "Forecast", "Parameters", "Displacements", "Curves", "Simulations", "Regions", "Accounts", "Origin"];
const questions = [/Does a simulation fit\?/, /Which one, and how sure\?/, /How did it end\?/, /How exact is the final shape\?/, /Parameter .*\[/];

async function checkAxe(browser) {
  const page = await (await browser.newContext({ bypassCSP: true })).newPage();  // the page's policy forbids all scripts
  await page.goto(url);
  await page.evaluate(readFileSync(require.resolve("axe-core/axe.min.js"), "utf8"));
  const { violations } = await page.evaluate(() => globalThis.axe.run());
  assert.deepEqual(violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html.slice(0, 120)).join(" | ")}`), [], "accessibility");
  await page.context().close();
}

/// Every picture is decoded, and no curve contains a coordinate that is not a number.
async function checkContent(page) {
  const seen = await page.evaluate(() => ({
    sections: [...document.querySelectorAll("section[aria-label]")].map((section) => section.ariaLabel),
    facts: document.querySelector(".facts").textContent,
    blank: [...document.images].filter((image) => image.naturalWidth === 0).length,
    images: document.images.length,
    broken: [...document.querySelectorAll("path")].filter((path) => /nan|inf/i.test(path.getAttribute("d"))).length,
  }));
  assert.deepEqual(seen.sections, sections);
  for (const question of questions) assert.match(seen.facts, question);
  assert.ok(seen.images >= 17, `${seen.images} pictures`);
  assert.deepEqual([seen.blank, seen.broken], [0, 0], "blank pictures, broken curves");
}

async function checkWidths(page) {
  for (const width of [480, 1060, 1920]) {
    await page.setViewportSize({ width, height: 900 });
    const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert.ok(wide <= 0, `at ${width} pixels the page is ${wide} pixels too wide`);
  }
}

/// Pages of A4, with the verdict on the first one.
async function checkPrint(page) {
  const pdf = await page.pdf({ preferCSSPageSize: true, path: join(out, "report.pdf") });
  const text = pdf.toString("latin1"), pages = text.match(/\/Type\s*\/Page\b/g).length;
  assert.ok(pages >= 5 && pages <= 20, `${pages} printed pages`);
  const [, width, height] = text.match(/\/MediaBox\s*\[0 0 ([\d.]+) ([\d.]+)\]/);
  assert.ok(Math.abs(width - 595) < 2 && Math.abs(height - 842) < 2, `printed on ${width} x ${height} points`);
}

async function main() {
  const executablePath = ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find(existsSync);
  if (!executablePath) {
    console.log("skipped: chromium is not installed; tools/install-packages.sh installs it");
    process.exit(77);
  }
  mkdirSync(out, { recursive: true });
  const browser = await require("playwright-core").chromium.launch({ executablePath, args: ["--no-sandbox"] });
  try {
    const page = await browser.newPage(), complaints = [], requests = [];
    page.on("console", (message) => complaints.push(message.text()));
    page.on("pageerror", (error) => complaints.push(String(error)));
    page.on("request", (request) => request.url().startsWith("data:") || requests.push(request.url()));
    await page.goto(url);
    await checkContent(page);
    await checkWidths(page);
    await checkPrint(page);
    writeFileSync(join(out, "report.png"), await page.screenshot({ fullPage: true }));
    assert.deepEqual([complaints, requests], [[], [url]], "console, requests");
    await checkAxe(browser);
    console.log(`ok; pictures in ${out}`);
  } finally {
    await browser.close();
  }
}

main().catch((error) => {
  console.error(error);
  process.exitCode = 1;
});
