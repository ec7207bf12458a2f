// The page in a real browser, with the real programs and the demo's test.
//   node page.mjs BUILD_DIR MODEL FRAMES_DIR SENSOR_JSON OUT_DIR
// Exit code 77: skipped, because there is no chromium or long tests are off.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { join } from "node:path";
import { cell, checkAxe, checkNoOverflow, count, launchBrowser, look, monitor, noteFrames, out, run, send, serve, set, shows, skipUnlessLong, sockets, start, stop, until, words } from "./browser_support.mjs";

const longestLoading = 1000;  // ms from loopback

/// Times of a page with an empty browser cache, in ms from the start of the navigation.
async function timesOf(browser, url, hasScene) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 720 } }), page = await context.newPage();
  await page.addInitScript(() => {
    new MutationObserver((_, observer) => {
      if (document.documentElement?.dataset.frame === undefined) return;
      observer.disconnect();
      requestAnimationFrame(() => requestAnimationFrame(() => (globalThis.sceneDrawn = performance.now())));
    }).observe(document, { attributes: true, attributeFilter: ["data-frame"], subtree: true });
  });
  await page.goto(url);
  const loaded = await page.evaluate(() => performance.getEntriesByType("navigation")[0].loadEventEnd);
  if (hasScene) await until(() => page.evaluate(() => globalThis.sceneDrawn !== undefined), "no scene is drawn");
  const drawn = await page.evaluate(() => globalThis.sceneDrawn ?? 0);
  await context.close();
  return { loaded, drawn };
}

/// The load event comes within a second with an empty cache; an empty page measures the browser's own share.
async function checkLoading(browser, url) {
  const empty = createServer((_, response) => response.setHeader("Content-Type", "text/html").end("<!doctype html><title>empty</title>"));
  await new Promise((done) => empty.listen(0, "127.0.0.1", done));
  const pages = [], empties = [];
  for (let i = 0; i < 5; ++i) {
    empties.push((await timesOf(browser, `http://127.0.0.1:${empty.address().port}/`, false)).loaded);
    pages.push(await timesOf(browser, url, true));
  }
  empty.close();
  const median = (values) => values.toSorted((x, y) => x - y)[Math.floor(values.length / 2)];
  const [loaded_ms, scene_drawn_ms, empty_page_ms] = [median(pages.map(({ loaded }) => loaded)), median(pages.map(({ drawn }) => drawn)), median(empties)];
  const figures = { loaded_ms, scene_drawn_ms, empty_page_ms };
  console.log(`page: load event after ${loaded_ms.toFixed(0)} ms, first scene drawn after ${scene_drawn_ms.toFixed(0)} ms; an empty page's load event after ${empty_page_ms.toFixed(0)} ms (medians of 5, empty cache)`);
  if (empty_page_ms > longestLoading) console.log("not checked: this machine needs more than a second for an empty page");
  else assert.ok(loaded_ms < longestLoading, `the page takes ${loaded_ms.toFixed(0)} ms to load, an empty one ${empty_page_ms.toFixed(0)} ms`);
  return figures;
}

async function checkPixels(page) {
  const both = await shows(page, (seen) => seen.drawn > 0.03 * seen.pixels, "the view is blank");
  await set(page, "show-mesh", false);
  const cloudAlone = await shows(page, (seen) => seen.cloud > 500 && seen.drawn < both.drawn, "there is no cloud");
  await set(page, "show-mesh", true);
  await set(page, "show-cloud", false);
  const meshAlone = await shows(page, (seen) => seen.cloud < cloudAlone.cloud / 20 && seen.drawn > 0.03 * seen.pixels, "there is no mesh");
  await set(page, "show-cloud", true);
  await shows(page, (seen) => seen.cloud > 100, "the cloud does not come back");
  return meshAlone;
}

/// Simulates a crash of the graphics driver or a suspend of the laptop.
async function checkLostGraphics(page) {
  const { background } = await look(page);
  await page.evaluate(async () => {
    const lost = document.getElementById("canvas").getContext("webgl2").getExtension("WEBGL_lose_context");
    lost.loseContext();
    await new Promise((done) => setTimeout(done, 200));
    lost.restoreContext();
  });
  await shows(page, (seen) => seen.drawn > 0.03 * seen.pixels && seen.background === background, "the view does not come back when the browser has lost it");
}

async function checkColors(page) {
  const before = await look(page);
  await page.locator("#color").selectOption("distance");
  await shows(page, (seen) => seen.hash !== before.hash && seen.colors > 40, "the distance is not shown in colors");
  assert.match(await words(page, "legend-title"), /distance.*mm/);
  await page.screenshot({ path: join(out, "distance.png") });
  await page.locator("#color").selectOption("field0");
  await until(async () => !/distance/.test(await words(page, "legend-title")), "the field's colors do not come back");
}

/// The published forecast: the ghost of the end can be switched, and what the shape does not tell is named.
async function checkForecast(page) {
  assert.match(await words(page, "forecast-shape"), /^Final shape within [\d.]+ mm \(90 %\)$/);
  assert.match(await words(page, "forecast-branches"), /^Branch \d (> )?\d+ %Branch \d/);
  assert.match(await words(page, "forecast-parameters"), /v0 \[m\/s\] [\d.]+ \u00b1 [\d.]+.*Not identifiable from shape: .*\bmu\b/);
  assert.ok(await page.locator("#forecast-chart canvas").count() === 1, "the bound is drawn over time");
  const without = await look(page);
  await set(page, "show-final", true);
  await shows(page, (seen) => seen.hash !== without.hash, "the forecast end is not shown");
  await page.screenshot({ path: join(out, "forecast.png") });
  await set(page, "show-final", false);
  await shows(page, (seen) => seen.hash === without.hash, "the forecast end stays");
}

async function checkSizes(page) {
  for (const [width, height] of [[1280, 720], [1920, 1080], [3840, 2160]]) {
    await page.setViewportSize({ width, height });
    await shows(page, (seen) => seen.drawn > 0.03 * seen.pixels, `the view stays blank at ${width}x${height}`);
    await checkNoOverflow(page, `${width}x${height}`);
    await page.screenshot({ path: join(out, `page-${width}x${height}.png`) });
  }
  await page.setViewportSize({ width: 1280, height: 720 });
}

const csvLines = async (url) => (await (await fetch(new URL("/export/curves.csv", url))).text()).trim().split("\n");
const csvRows = async (url) => (await csvLines(url)).length - 1;

async function checkExports(page, url) {
  const lines = await csvLines(url);
  assert.ok(lines.length >= 22 && lines[0].startsWith("time_s,frame,verdict"), `CSV has ${lines.length} lines`);
  const vtu = await page.request.get(new URL(await page.locator("#save-vtu").getAttribute("href"), url).href);
  assert.ok(vtu.ok() && (await vtu.body()).subarray(0, 300).toString().includes("UnstructuredGrid"), "VTU");
  const [download] = await Promise.all([page.waitForEvent("download"), page.locator("#save-png").click()]);
  const png = readFileSync(await download.path());
  assert.ok(png.subarray(1, 4).toString() === "PNG" && png.length > 5000, "PNG");
}

async function checkKeyboard(page) {
  const before = await look(page);
  await page.locator("#canvas").focus();
  await page.keyboard.press("ArrowLeft");
  await page.keyboard.press("+");
  await shows(page, (seen) => seen.hash !== before.hash, "the arrow keys do not turn the view");
  await page.keyboard.press("f");
}

/// The recording of the test in the page: any frame can be selected.
async function checkRecording(browser, recording) {
  const program = start("lbea-monitor", recording, "--http", "127.0.0.1:0");
  await program.ready();
  const url = program.said.match(/http:\/\/\S+/)[0];
  const page = await browser.newPage({ viewport: { width: 1280, height: 720 } });
  const complaints = [];
  page.on("console", (message) => message.type() === "error" && complaints.push(message.text()));
  page.on("pageerror", (error) => complaints.push(String(error)));
  await page.goto(url);
  const shown = (frame) => until(() => page.evaluate((wanted) => document.documentElement.dataset.frame === wanted, String(frame)), `frame ${frame} of the recording is not shown`);
  await shown(0);
  const first = await shows(page, (seen) => seen.cloud > 500, "the recording's first frame has no cloud");
  await page.locator("#scrub").fill("20");
  await shown(20);
  await shows(page, (seen) => seen.cloud > 100 && seen.hash !== first.hash, "the recording's last frame looks like the first");
  assert.match(await words(page, "connection"), /complete/);
  assert.equal(await words(page, "scrub-at"), "21 of 21");
  await page.locator("#scrub").press("ArrowLeft");
  await shown(19);
  // While scrubbing, every requested frame is shown, and the last one is that of the slider.
  await noteFrames(page);
  const asked = [19];
  page.on("request", (request) => /number=/.test(request.url()) && asked.push(Number(new URL(request.url()).searchParams.get("number"))));
  for (let i = 0; i < 8; ++i) await page.locator("#scrub").press("ArrowLeft");
  await shown(11);
  assert.deepEqual(await page.evaluate(() => framesShown), asked, "requested frames and shown frames");
  await noteFrames(page);
  await page.locator("#play").click();
  // Playing is as fast as the machine draws.
  for (let i = 1; i <= 25; ++i) await until(() => page.evaluate((wanted) => framesShown.length >= wanted, i), `the recording does not play on after ${i - 1} frames`);
  const played = await page.evaluate(() => framesShown.slice(0, 25));
  assert.deepEqual(played, played.map((_, i) => (11 + i) % 21), "while playing, every frame is shown in order, and the first follows the last");
  await page.locator("#play").click();
  await page.screenshot({ path: join(out, "recording.png") });
  assert.deepEqual(complaints, [], "console, recording");
  await page.close();
  await stop(program);
}

async function main() {
  const recording = join(sockets, "run.mcap");
  const browser = await launchBrowser();
  try {
    let server = await serve("--method", "fit", "--record", recording);
    const served = await monitor(), { url } = served;
    const page = await browser.newPage({ viewport: { width: 1280, height: 720 }, acceptDownloads: true, bypassCSP: false });
    const complaints = [], outside = [];
    page.on("console", (message) => ["error", "warning"].includes(message.type()) && complaints.push(message.text()));
    page.on("pageerror", (error) => complaints.push(String(error)));
    page.on("request", (request) => new URL(request.url()).origin !== new URL(url).origin && !request.url().startsWith("blob:") && outside.push(request.url()));
    await page.goto(url);
    await until(() => page.evaluate(() => document.getElementById("counters").children.length > 0), "nothing arrived over the WebSocket");
    await noteFrames(page);
    const camera = send("--rate", "1");
    await until(async () => (await csvRows(url)) > 0, "the first frame does not arrive");
    // Pauses the test: a live page shows the newest frame, so a busy machine would skip the first one.
    camera.kill("SIGSTOP");
    await until(() => page.evaluate(() => framesShown.includes(0)), "the first frame is not shown");
    const first = await shows(page, (seen) => seen.drawn > 0.02 * seen.pixels, "the first frame is blank");
    await page.screenshot({ path: join(out, "first-frame.png") });
    camera.kill("SIGCONT");
    await until(async () => /complete/.test(await words(page, "verdict-why")), "the end of the test is not shown", 60_000);  // it plays for 20 s
    await until(() => page.evaluate(() => document.documentElement.dataset.frame === "20"), "the last frame is not shown");
    await camera.ended;
    const last = await shows(page, (seen) => seen.hash !== first.hash && seen.colors > first.colors, "colors do not change with the deformation");
    await page.screenshot({ path: join(out, "last-frame.png") });
    const framesSeen = await page.evaluate(() => framesShown);
    assert.ok(framesSeen.every((frame, i) => i === 0 || frame > framesSeen[i - 1]), `frames go back: ${framesSeen}`);
    await until(async () => (await count(page, "Matched")) === 21, "the page does not count all frames");  // states follow later
    assert.equal(await cell(page, "Recording"), "all 21 frames", "the file is complete when lbea-serve has closed it");
    assert.match(await cell(page, "Disk"), /^[\d.]+ [MGT]B/);
    assert.equal(await words(page, "verdict-word"), "Matched");
    assert.match(await words(page, "best"), /^run_\d+ \(\d+ %\)/);
    assert.match(await words(page, "frame-verdict"), /^Frame 20: .*run_\d+/);
    await checkPixels(page);
    await checkLostGraphics(page);
    await checkColors(page);
    await checkForecast(page);
    assert.equal(await page.locator("#channels-panel").isHidden(), true, "a model without channels shows none");
    await checkExports(page, url);
    await checkKeyboard(page);
    await checkSizes(page);
    for (const theme of ["light", "dark"]) await checkAxe(browser, url, theme);
    const loading = await checkLoading(browser, url);
    const before = await look(page);
    await page.locator("#theme").click();
    await shows(page, (seen) => seen.hash !== before.hash, "the dark theme does not reach the view");
    // The matcher is restarted: the page continues by itself.
    await stop(server);
    await until(async () => /Nothing from lbea-serve/.test(await words(page, "connection")), "the page does not say that lbea-serve is gone");
    await page.evaluate(() => (globalThis.sameDocument = true));
    await checkRecording(browser, recording);
    server = await serve("--method", "fit");
    const again = send("--rate", "100", "--loop", "0");
    await until(async () => (await words(page, "connection")) === "Live" && (await count(page, "Matched")) > 21, "a new lbea-serve is not followed");
    // The connection is lost: the page reconnects without a reload.
    await stop(served);
    await until(async () => /trying again/.test(await words(page, "connection")), "the page does not say that lbea-monitor is gone");
    const complaintsBefore = complaints.length;
    await monitor(new URL(url).host);
    await until(async () => (await words(page, "connection")) === "Live", "the page does not connect again");
    assert.equal(await page.evaluate(() => globalThis.sameDocument), true, "the page was reloaded");
    await stop(again);
    const refused = complaints.filter((text) => /WebSocket connection.*failed|CONTEXT_LOST_WEBGL|Context (Lost|Restored)/.test(text));
    assert.deepEqual(complaints.filter((text) => !refused.includes(text)), [], "console");
    assert.ok(complaintsBefore >= 0 && outside.length === 0, `requests to elsewhere: ${outside}`);
    writeFileSync(join(out, "measured.json"), JSON.stringify({ ...loading, last }, null, 1));
  } finally {
    await browser.close();
  }
}

skipUnlessLong();
run(main);
