// The page with two components in a real browser, in a running test and of its recording.
//   node components_page.mjs BUILD_DIR MODEL FRAMES_DIR SENSOR_JSON OUT_DIR MODEL_WITH_CHANNELS
// Exit code 77: skipped, because there is no chromium or long tests are off.
import assert from "node:assert/strict";
import { basename, join } from "node:path";
import { checkAxe, checkNoOverflow, endpoint, launchBrowser, look, model, otherModel, out, run, send, serveComponents, set, shows, skipUnlessLong, sockets, stop, until, watch, words } from "./browser_support.mjs";

const names = [model, otherModel].map((file) => basename(file, ".lbea"));

async function open(browser, url) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 720 } });
  page.complaints = [];
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && page.complaints.push(message.text()));
  page.on("pageerror", (error) => page.complaints.push(String(error)));
  await page.goto(url);
  return page;
}

const box = (page, i) => page.getByRole("checkbox", { name: `Show ${names[i]}` });
const radio = (page, i) => page.getByRole("radio", { name: names[i] });
const verdictOf = (page, i) => page.locator("#component-list .component-verdict").nth(i).textContent();

/// What is hidden is not drawn, by the keyboard alone.
async function checkShown(page) {
  await set(page, "show-cloud", false);
  const both = await shows(page, (seen) => seen.drawn > 0.03 * seen.pixels && seen.cloud < 100, "there is no mesh");
  await box(page, 1).focus();
  await page.keyboard.press("Space");
  await shows(page, (seen) => seen.hash !== both.hash && seen.drawn > 0.03 * seen.pixels, "hiding a component changes nothing");
  await box(page, 0).focus();
  await page.keyboard.press("Space");
  await shows(page, (seen) => seen.drawn < 0.001 * seen.pixels, "both are hidden, and something is drawn");
  for (const i of [0, 1]) {
    await box(page, i).focus();
    await page.keyboard.press("Space");
  }
  await shows(page, (seen) => seen.hash === both.hash, "the components do not come back");
  await set(page, "show-cloud", true);
}

/// The panels show the component that the keyboard chooses.
async function checkFront(page) {
  const isInFront = (i) => until(async () => (await page.locator("#verdict-panel").getAttribute("aria-label")) === `Verdict of ${names[i]}`, `${names[i]} is not in front`);
  const channels = page.locator("#channels-panel");
  assert.equal(await channels.isVisible(), false, `${names[0]} has no quantities of interest`);
  await radio(page, 0).focus();
  await page.keyboard.press("ArrowDown");
  await isInFront(1);
  await until(() => channels.isVisible(), `${names[1]} has quantities of interest`);
  await until(async () => /\u00b1|unknown|mm/.test(await page.locator(".channel-words").first().textContent()), "a quantity of interest has no value");
  await until(async () => (await verdictOf(page, 1)).endsWith(`: ${await words(page, "best")}`), "the headline is that of another component");
  await until(async () => /component=1/.test(await page.locator("#save-csv").getAttribute("href")), "the exports are not those of the component");
  assert.match(await page.locator("#save-vtu").getAttribute("href"), /component=1&shape=/);
  await until(() => page.evaluate(() => document.querySelectorAll("#probability-list li").length > 0), "there are no curves of the other component");
  await page.screenshot({ path: join(out, "components-other.png") });
  await page.keyboard.press("ArrowUp");
  await isInFront(0);
  assert.match(await verdictOf(page, 0), /^\u2713 Matched: run_\d+ \(\d+ %\)/);
  assert.equal(await channels.isVisible(), false);
}

async function checkRecording(browser, recording) {
  const watcher = await watch(recording, "--http", "127.0.0.1:0"), page = await open(browser, watcher.url);
  const shown = (frame) => until(() => page.evaluate((wanted) => document.documentElement.dataset.frame === wanted, String(frame)), `frame ${frame} of the recording is not shown`);
  await shown(0);
  const first = await look(page);
  await page.locator("#scrub").fill("20");
  await shown(20);
  await shows(page, (seen) => seen.hash !== first.hash && seen.cloud > 100, "the last frame looks like the first");
  await checkFront(page);
  await page.screenshot({ path: join(out, "components-recording.png") });
  assert.deepEqual(page.complaints, [], "console, recording");
  await page.close();
  await stop(watcher);
}

/// With one model, there is nothing to choose.
async function checkOne(browser, recording) {
  const watcher = await watch(recording, "--http", "127.0.0.1:0", "--model", otherModel), page = await open(browser, watcher.url);
  await until(async () => /Matched|No verdict/.test(await words(page, "verdict-word")), "the component is not shown");
  assert.equal(await page.locator("#components").isVisible(), false);
  await page.close();
  await stop(watcher);
}

async function main() {
  const recording = join(sockets, "run.mcap"), browser = await launchBrowser();
  try {
    const server = await serveComponents("--record", recording);
    const watcher = await watch("--results", endpoint("results"), "--frames", endpoint("preview"), "--http", "127.0.0.1:0");
    const page = await open(browser, watcher.url);
    await until(() => page.locator("#components").isVisible(), "the chooser is not shown");
    assert.equal(await send("--rate", "5").ended, 0);
    await until(async () => /complete/.test(await words(page, "verdict-why")), "the end of the test is not shown", 60_000);
    await until(() => page.evaluate(() => document.documentElement.dataset.frame === "20"), "the last frame is not shown");
    await checkShown(page);
    await checkFront(page);
    for (const [width, height] of [[1280, 720], [1920, 1080], [3840, 2160]]) {
      await page.setViewportSize({ width, height });
      await shows(page, (seen) => seen.drawn > 0.03 * seen.pixels, `the view stays blank at ${width}x${height}`);
      await checkNoOverflow(page, `${width}x${height}`);
      await page.screenshot({ path: join(out, `components-${width}x${height}.png`) });
    }
    for (const theme of ["light", "dark"]) await checkAxe(browser, watcher.url, theme);
    assert.deepEqual(page.complaints, [], "console");
    await page.close();
    for (const program of [watcher, server]) await stop(program);
    await checkRecording(browser, recording);
    await checkOne(browser, recording);
  } finally {
    await browser.close();
  }
}

skipUnlessLong();
run(main);
