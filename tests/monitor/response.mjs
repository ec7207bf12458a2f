// The page while 1,300 results per second arrive: delay until the page handles a key, and processor time of the page.
//   node response.mjs BUILD_DIR MODEL FRAMES_DIR SENSOR_JSON OUT_DIR
// Exit code 77: skipped, because there is no chromium or long tests are off.
import assert from "node:assert/strict";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { count, launchBrowser, monitor, out, run, send, serve, skipUnlessLong, until, words } from "./browser_support.mjs";

const rate = 1300, presses = 60, pause = 60;  // per second; keys; ms between two of them
const longestDelay = 100, mostWork = 50;  // ms on an idle machine; ms of processor time that one task of the page may take
const share = (values, p) => values.toSorted((a, b) => a - b)[Math.min(values.length - 1, Math.floor(p * values.length))];

/// Loop times in an empty page; their ratio to the shortest one measures how busy the machine is.
const loopTimes = (page) =>
  page.evaluate(() => Array.from({ length: 60 }, () => {
    const begin = performance.now();
    for (let i = 0, x = 1; i < 2e6; ++i) globalThis.sink = x = (x * 1.0000001 + i) % 7;
    return performance.now() - begin;
  }));

const noteDelays = (page) =>
  page.evaluate(() => {
    globalThis.delays = [];
    addEventListener("keydown", (event) => delays.push(performance.now() - event.timeStamp), { capture: true });
  });

/// Processor times in ms of the tasks of the page's main thread; they do not depend on other load.
function tasksOf(trace) {
  const { traceEvents } = JSON.parse(trace);
  const threads = traceEvents.filter(({ name, args }) => name === "thread_name" && args.name === "CrRendererMain").map(({ pid, tid }) => `${pid} ${tid}`);
  const tasks = threads.map((thread) => traceEvents.filter(({ name, ph, pid, tid }) => name === "RunTask" && ph === "X" && `${pid} ${tid}` === thread).map(({ tdur }) => (tdur ?? 0) / 1000));
  const work = (durations) => durations.reduce((sum, duration) => sum + duration, 0);
  return tasks.sort((a, b) => work(b) - work(a))[0];
}

async function measure(browser, page, empty) {
  await page.locator("#canvas").focus();
  for (const each of [page, empty]) await noteDelays(each);
  await browser.startTracing(page, { categories: ["toplevel", "devtools.timeline", "disabled-by-default-devtools.timeline"] });
  const begin = Date.now(), framesBefore = await page.evaluate(() => framesDrawn);
  for (let i = 0; i < presses; ++i) {
    for (const each of [page, empty]) await each.keyboard.press(i % 2 ? "ArrowLeft" : "ArrowRight");
    await page.waitForTimeout(pause);
  }
  const seconds = (Date.now() - begin) / 1000, drawn = (await page.evaluate(() => framesDrawn)) - framesBefore;
  const tasks = tasksOf(await browser.stopTracing());
  const [delays, idle] = await Promise.all([page, empty].map((each) => each.evaluate(() => delays)));
  assert.equal(delays.length, presses);
  return { seconds, delays, idle, longest_task_ms: Math.max(...tasks), page_work_ms_per_s: tasks.reduce((sum, task) => sum + task, 0) / seconds, animation_frames_per_second: drawn / seconds };
}

async function main() {
  const browser = await launchBrowser();
  try {
    await serve("--method", "lbea");
    const { url } = await monitor();
    const empty = await browser.newPage(), page = await browser.newPage({ viewport: { width: 1280, height: 720 } });
    await page.addInitScript(() => {
      globalThis.framesDrawn = 0;
      const next = () => requestAnimationFrame(() => (++globalThis.framesDrawn, next()));
      next();
    });
    await page.goto(url);
    await until(async () => (await words(page, "connection")) !== "Connecting", "the page does not connect");
    send("--rate", String(rate), "--loop", "0");
    const results = () => count(page, "Rate");
    await until(async () => (await results()) > 0.8 * rate, async () => `${await results()} results a second instead of ${rate}`);
    await page.waitForTimeout(3000);
    const before = await loopTimes(empty), { delays, idle, ...measured } = await measure(browser, page, empty), loops = [...before, ...(await loopTimes(empty))];
    const slowness = loops.reduce((sum, time) => sum + time, 0) / loops.length / Math.min(...loops);
    const figures = { results_per_second: await results(), ...measured, delay_ms: { p50: share(delays, 0.5), p95: share(delays, 0.95), longest: Math.max(...delays) },
      empty_page_delay_ms: { p50: share(idle, 0.5), p95: share(idle, 0.95), longest: Math.max(...idle) }, slowness };
    console.log(JSON.stringify(figures, (_, value) => (typeof value === "number" ? +value.toPrecision(4) : value), 1));
    writeFileSync(join(out, "response.json"), JSON.stringify(figures, null, 1));
    const added = figures.delay_ms.p95 - figures.empty_page_delay_ms.p95;
    assert.ok(added < longestDelay * slowness, `a key waits ${added.toFixed(0)} ms longer than in an empty page, with a processor ${slowness.toFixed(1)} times slower than when idle`);
    assert.ok(figures.longest_task_ms > 0 && figures.longest_task_ms < mostWork, `one task of the page takes ${figures.longest_task_ms.toFixed(0)} ms of processor time`);
  } finally {
    await browser.close();
  }
}

skipUnlessLong();
run(main);
