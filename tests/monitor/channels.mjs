// The quantities of interest on the page, in a real browser, of a test in progress, a test before, and a recording.
//   node channels.mjs BUILD_DIR MODEL_WITH_CHANNELS FRAMES_DIR SENSOR_JSON OUT_DIR
// Exit code 77: skipped, because there is no chromium or long tests are off.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { launchBrowser, monitor, out, require, run, send, sensor, serve, serveFrom, skipUnlessLong, sockets, start, stop, until, words } from "./browser_support.mjs";

const names = ["struck end", "struck end, velocity"], units = ["mm", "mm/s"];

const card = (page, i) => page.locator("#channels > li").nth(i);
const valueOf = (page, i) => card(page, i).locator(".channel-words").textContent();

/// Shares of the columns of pixels that show the curve, which is opaque, and its band, which is translucent and thicker than an edge.
const curve = (page, i) =>
  card(page, i).locator("canvas").evaluate((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    const [r, g, b] = getComputedStyle(document.documentElement).getPropertyValue("--accent").match(/\w\w/g).map((part) => parseInt(part, 16));
    const columns = new Set(), band = new Array(canvas.width).fill(0);
    for (let at = 0; at < data.length; at += 4) {
      const near = Math.abs(data[at] - r) + Math.abs(data[at + 1] - g) + Math.abs(data[at + 2] - b) < 24, column = (at / 4) % canvas.width;
      if (near && data[at + 3] > 200) columns.add(column);
      if (near && Math.abs(data[at + 3] - 0x40) < 4) ++band[column];
    }
    return { curve: columns.size / canvas.width, band: band.filter((pixels) => pixels > 3).length / canvas.width };
  });
const draws = (page, i, holds, complaint) => {
  let seen;
  return until(async () => (await card(page, i).locator("canvas").count()) === 1 && holds((seen = await curve(page, i))), () => `${complaint}: ${JSON.stringify(seen)}`);
};

async function open(browser, url, more = {}) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 720 }, ...more });
  page.complaints = [];
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && page.complaints.push(message.text()));
  page.on("pageerror", (error) => page.complaints.push(String(error)));
  await page.goto(url);
  await until(() => page.locator("#channels-panel").isVisible(), "the panel is not shown");
  assert.deepEqual(await page.locator("#channels h3").allTextContents(), names);
  return page;
}

async function checkBounded(page) {
  for (const i of [0, 1]) {
    const shown = await valueOf(page, i), [, value, bound] = shown.match(/^(-?[\d.]+) \u00b1 ([\d.]+) .*\(90 %\)$/) ?? [];
    assert.ok(shown.includes(` ${units[i]} `) && bound > 0, shown);
    if (i === 0) assert.ok(value < -50, `the struck end moves against x: ${shown}`);
    await draws(page, i, ({ curve, band }) => curve > 0.5 && band > 0.1, `${names[i]} is not drawn over the test`);
  }
}

async function checkAxe(browser, url, colorScheme) {
  const page = await open(browser, url, { bypassCSP: true, colorScheme });
  await until(async () => /\u00b1/.test(await valueOf(page, 0)), "a browser that connects later has no values");
  await page.evaluate(readFileSync(require.resolve("axe-core/axe.min.js"), "utf8"));
  const { violations } = await page.evaluate(() => globalThis.axe.run());
  await draws(page, 0, ({ curve }) => curve > 0.5, "a browser that connects later has no curves");
  await page.screenshot({ path: join(out, `channels-${colorScheme}.png`) });
  await page.close();
  assert.deepEqual(violations.filter(({ impact }) => ["serious", "critical"].includes(impact)).map(({ id, nodes }) => `${id}: ${nodes[0].html}`), [], `accessibility, ${colorScheme}`);
}

async function checkSizes(page) {
  for (const [width, height] of [[1280, 720], [1920, 1080], [3840, 2160]]) {
    await page.setViewportSize({ width, height });
    const layout = await page.evaluate(() => ({
      wide: document.documentElement.scrollWidth > innerWidth || document.documentElement.scrollHeight > innerHeight,
      small: [...document.querySelectorAll(".chart, .plane, #stage")].filter((e) => e.clientHeight < 60).map((e) => e.id || e.className),
    }));
    assert.deepEqual(layout, { wide: false, small: [] }, `layout at ${width}x${height}`);
  }
  await page.setViewportSize({ width: 1280, height: 720 });
  // As many channels as do not fit: they scroll, and the columns of the page keep their widths.
  const widths = await page.evaluate(() => {
    const cards = [...document.querySelectorAll(".channel")], all = () => ["#view", "#stage", "#panels", "#channels"].map((e) => document.querySelector(e).clientWidth);
    const before = all();
    for (const { style } of cards) style.flexBasis = "60rem";
    const after = all(), scrolls = document.getElementById("channels").scrollWidth > after[3];
    for (const { style } of cards) style.flexBasis = "";
    return { before, after, scrolls };
  });
  assert.deepEqual(widths, { before: widths.before, after: widths.before, scrolls: true }, "more channels than fit");
}

/// A frame in the middle of the recording, and the curves of the whole test at once.
async function checkRecording(browser, recording) {
  const program = start("lbea-monitor", recording, "--http", "127.0.0.1:0");
  await program.ready();
  const page = await open(browser, program.said.match(/http:\/\/\S+/)[0]);
  await until(async () => /\u00b1/.test(await valueOf(page, 0)), "the recording's first frame has no values");
  const first = await valueOf(page, 0);
  await draws(page, 0, ({ curve }) => curve > 0.5, "the curve of the whole test is not drawn");
  await page.locator("#scrub").fill("20");
  await until(async () => (await valueOf(page, 0)) !== first, "the values stay those of the first frame");
  await checkBounded(page);
  await page.screenshot({ path: join(out, "channels-recording.png") });
  assert.deepEqual(page.complaints, [], "console, recording");
  await page.close();
  await stop(program);
}

/// A sensor description whose pose is wrong by `mm` along z.
function sensorMovedBy(mm) {
  const moved = JSON.parse(readFileSync(sensor, "utf8")), file = join(sockets, "moved.json");
  for (const pose of [moved.T_reference_sensor, moved.sensor.T_reference_right]) pose[2][3] += mm;
  writeFileSync(file, JSON.stringify(moved));
  return file;
}

async function main() {
  const recording = join(sockets, "run.mcap"), browser = await launchBrowser();
  try {
    let server = await serve("--method", "fit", "--record", recording);
    let watcher = await monitor();
    let page = await open(browser, watcher.url);
    assert.match(await valueOf(page, 0), /^- *$/, "before the first frame");
    await send("--rate", "20").ended;
    await until(async () => /complete/.test(await words(page, "verdict-why")), "the end of the test is not shown", 60_000);
    await checkBounded(page);
    await checkSizes(page);
    for (const theme of ["light", "dark"]) await checkAxe(browser, watcher.url, theme);
    const [head, last] = (await (await fetch(new URL("/export/curves.csv", watcher.url))).text()).trim().split("\n").filter((_, i, all) => i === 0 || i === all.length - 1);
    assert.ok(head.endsWith(',struck end [mm],struck end bound_90 [mm],"struck end, velocity [mm/s]","struck end, velocity bound_90 [mm/s]"'), head);
    assert.ok(Number(last.split(",").at(-4)) < -50, last);
    assert.deepEqual(page.complaints, [], "console");
    await page.close();
    for (const program of [watcher, server]) await stop(program);
    await checkRecording(browser, recording);

    // Method lbea knows values without intervals.
    server = await serve("--method", "lbea");
    watcher = await monitor();
    page = await open(browser, watcher.url);
    await send("--rate", "20").ended;
    await until(async () => /^-[\d.]+ mm \(interval unknown\)$/.test(await valueOf(page, 0)), () => valueOf(page, 0));
    await draws(page, 0, ({ curve, band }) => curve > 0.5 && band < 0.02, "a curve without intervals");
    await page.screenshot({ path: join(out, "channels-lbea.png") });
    assert.deepEqual(page.complaints, [], "console, lbea");
    for (const program of [watcher, server]) await stop(program);

    // Frames that no simulation fits have values, which are not shown.
    server = await serveFrom(sensorMovedBy(20), "--method", "fit", "--fixed-pose");
    watcher = await monitor();
    page = await open(browser, watcher.url);
    await send("--rate", "20").ended;
    await until(async () => /complete/.test(await words(page, "verdict-why")), "the end of the doubtful test is not shown", 60_000);
    await until(async () => /^unknown \(frame in doubt: no simulation fits\)$/.test(await valueOf(page, 0)), () => valueOf(page, 0));
    await until(async () => (await card(page, 0).locator("canvas").count()) === 1, "the empty chart is not drawn");
    await page.screenshot({ path: join(out, "channels-doubtful.png") });
    assert.ok((await curve(page, 0)).curve < 0.05, "doubtful values are drawn");
    assert.deepEqual(page.complaints, [], "console, doubtful");
    for (const program of [watcher, server]) await stop(program);
  } finally {
    await browser.close();
  }
}

skipUnlessLong();
run(main);
