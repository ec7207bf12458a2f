// Shared by the browser tests: programs under test, waiting, Chromium.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";

const [build, model, frames, sensor, outFolder] = process.argv.slice(2);
export { model, frames, sensor };
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
export const send = (...more) => start("lbea-send", frames, "--to", endpoint("frames"), ...more);
export const stop = async (child) => {
  child.kill("SIGINT");
  await child.ended;
};

/// Serves the page of a running test; its address is in `url`.
export async function monitor(http = "127.0.0.1:0", ...more) {
  const child = start("lbea-monitor", "--results", endpoint("results"), "--frames", endpoint("preview"), "--model", model, "--http", http, ...more);
  await child.ready();
  child.url = child.said.match(/http:\/\/\S+/)[0];
  return child;
}

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
