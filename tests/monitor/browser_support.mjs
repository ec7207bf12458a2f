// Shared by the browser tests: programs under test, waiting, Chromium.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";

const [build, model, frames, sensor, outFolder, otherModel] = process.argv.slice(2);
export { model, frames, sensor, otherModel };
export const out = outFolder;
export const require = createRequire(join(process.env.LBEA_NODE_MODULES ?? process.cwd(), "page.mjs"));
export const sockets = mkdtempSync(join(tmpdir(), "lbea-monitor-test-"));
export const endpoint = (name) => `ipc://${join(sockets, name)}`;
const running = new Set();

function skip(why) {
  console.log(`skipped: ${why}`);
  rmSync(sockets, { recursive: true, force: true });
  process.exit(77);
}

/// A browser that renders in software during a test takes minutes on two cores, and is too slow on a busy machine.
export function skipUnlessLong() {
  if (process.env.LBEA_LONG_TESTS !== "1") skip("only bash tests/run.sh --long tests the page in a browser");
}

export function launchBrowser() {
  const executablePath = ["/usr/bin/chromium", "/usr/bin/chromium-browser"].find(existsSync);
  if (!executablePath) skip("chromium is not installed; tools/install-packages.sh installs it");
  mkdirSync(out, { recursive: true });
  return require("playwright-core").chromium.launch({ executablePath, args: ["--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader"] });
}

/// Starts a program; `ready()` waits until its stderr says that it is ready. `said` is its stderr, `printed` its stdout.
export function start(program, ...parameters) {
  const child = spawn(join(build, "tools", program.slice(5), program), parameters, { stdio: ["ignore", "pipe", "pipe"] });
  running.add(child);
  child.ended = new Promise((done) => child.on("exit", (code) => (running.delete(child), done(code))));
  child.said = child.printed = "";
  child.stdout.on("data", (text) => (child.printed += text));
  child.stderr.on("data", (text) => (child.said += text));
  child.ready = () => until(() => /ready/.test(child.said), () => `${program} is not ready: ${child.said}`);
  return child;
}

export async function until(holds, complaint, patience = 30_000) {
  const deadline = Date.now() + patience;
  while (!(await holds())) {
    if (Date.now() > deadline) assert.fail(typeof complaint === "function" ? await complaint() : complaint);
    await new Promise((done) => setTimeout(done, 30));
  }
}

export const serve = (...more) => serveFrom(sensor, ...more);
/// A matcher with another pose than that of the frames.
export const serveFrom = async (pose, ...more) => {
  const server = start("lbea-serve", model, "--frames", endpoint("frames"), "--results", endpoint("results"), "--preview", endpoint("preview"),
    "--pose", pose, ...more);
  await server.ready();
  return server;
};
/// A matcher with both models, as two components of one test.
export const serveComponents = (...more) => serve(otherModel, "--method", "fit", ...more);
export const send = (...more) => start("lbea-send", frames, "--to", endpoint("frames"), ...more);
export const stop = async (child) => {
  child.kill("SIGINT");
  await child.ended;
};

/// Starts lbea-monitor; the address of its page is in `url`.
export async function watch(...parameters) {
  const child = start("lbea-monitor", ...parameters);
  await child.ready();
  child.url = child.said.match(/http:\/\/\S+/)[0];
  return child;
}
/// Serves the page of a running test.
export const monitor = (http = "127.0.0.1:0", ...more) =>
  watch("--results", endpoint("results"), "--frames", endpoint("preview"), "--model", model, "--http", http, ...more);

/// Collects the frames that the page shows from now on in `globalThis.framesShown`. Polling from outside would miss frames that are
/// shown briefly.
export const noteFrames = (page) =>
  page.evaluate(() => {
    const root = document.documentElement;
    globalThis.framesShown = root.dataset.frame === undefined ? [] : [Number(root.dataset.frame)];
    const note = () => framesShown.at(-1) !== Number(root.dataset.frame) && framesShown.push(Number(root.dataset.frame));
    new MutationObserver(note).observe(root, { attributeFilter: ["data-frame"] });
  });

export const words = (page, id) => page.locator(`#${id}`).textContent();
/// The value of `name` in the health line.
export const cell = (page, name) => page.locator("#counters > div", { has: page.getByText(name, { exact: true }) }).locator("dd").textContent();
export const count = async (page, name) => {
  const text = await cell(page, name);
  return Number(text.replaceAll(",", "").replace(/ .*/, ""));
};

/// Counts the pixels of the 3D view that differ from the background, those in the color of the cloud, and the colors.
export const look = (page) =>
  page.evaluate(async () => {
    const canvas = document.getElementById("canvas"), copy = document.createElement("canvas");
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    [copy.width, copy.height] = [canvas.width, canvas.height];
    const context = copy.getContext("2d");
    context.drawImage(canvas, 0, 0);
    const { data } = context.getImageData(0, 0, copy.width, copy.height);
    const seen = { drawn: 0, cloud: 0, hash: 0, pixels: copy.width * copy.height, background: [...data.slice(0, 3)].join() };
    const colors = new Set();
    for (let i = 0; i < data.length; i += 4) {
      const [r, g, b] = [data[i], data[i + 1], data[i + 2]];
      if (Math.abs(r - data[0]) + Math.abs(g - data[1]) + Math.abs(b - data[2]) < 24) continue;
      ++seen.drawn;
      if (r > 150 && g < 110 && b > 70 && b < 170) ++seen.cloud;
      colors.add((r >> 3) * 1024 + (g >> 3) * 32 + (b >> 3));
      seen.hash = (seen.hash * 31 + i + r * 7 + g * 3 + b) | 0;
    }
    return { ...seen, colors: colors.size };
  });

export const set = (page, id, on) => page.locator(`#${id}`).setChecked(on);
/// Waits until the view fulfills `holds`: software rendering is slow.
export const shows = async (page, holds, complaint) => {
  let seen;
  await until(async () => holds((seen = await look(page))), () => `${complaint}: ${JSON.stringify(seen)}`);
  return seen;
};

export async function checkNoOverflow(page, name) {
  const cut = await page.evaluate(() => {
    const wide = document.documentElement.scrollWidth > innerWidth || document.documentElement.scrollHeight > innerHeight;
    const small = [...document.querySelectorAll(".chart, .plane, #stage")].filter((e) => e.clientHeight < 60).map((e) => e.id || e.className);
    return { wide, small };
  });
  assert.deepEqual(cut, { wide: false, small: [] }, `layout at ${name}`);
}

/// In a separate page: the checker is an inline script, which the policy of the page forbids.
export async function checkAxe(browser, url, name) {
  const context = await browser.newContext({ bypassCSP: true, colorScheme: name, viewport: { width: 1280, height: 720 } });
  const page = await context.newPage();
  await page.goto(url);
  await until(() => page.evaluate(() => document.querySelectorAll("#probability-list li").length > 0), "a browser that connects later has no curves");
  await page.evaluate(readFileSync(require.resolve("axe-core/axe.min.js"), "utf8"));
  const { violations } = await page.evaluate(() => globalThis.axe.run());
  await page.screenshot({ path: join(out, `page-${name}.png`) });
  await context.close();
  const serious = violations.filter(({ impact }) => impact === "serious" || impact === "critical");
  assert.deepEqual(serious.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html.slice(0, 120)).join(" | ")}`), [], `accessibility, ${name}`);
}

/// Runs a test and then ends all programs that it started.
export function run(test) {
  test()
    .then(() => console.log(`ok${out ? `; screenshots in ${out}` : ""}`))
    .catch((error) => {
      console.error(error);
      process.exitCode = 1;
    })
    .finally(() => {
      for (const child of running) child.kill("SIGKILL");
      rmSync(sockets, { recursive: true, force: true });
    });
}
