// The panels with text and numbers: verdict, best simulation, parameters, health.
import { style } from "./colors.js";

export const byId = (id) => document.getElementById(id);
const put = (id, text) => {
  const element = byId(id);
  if (element.textContent !== text) element.textContent = text;
};

const verdicts = {
  matched: ["\u2713", "Matched"],
  doubtful: ["?", "Matched, in doubt"],
  ambiguous: ["?", "Ambiguous"],
  no_simulation_fits: ["\u2715", "No simulation fits"],
  low_coverage: ["\u25D0", "Low coverage"],
  refused: ["\u2715", "Frame refused"],
  unknown: ["\u2013", "No verdict"],
};
const ofTest = {
  matched: "These simulations explain the test.",
  ambiguous: "Clearly different simulations explain the test equally well.",
  no_simulation_fits: "The measured shapes differ from all simulations.",
};
const ofFrame = {
  low_coverage: "The frame covers too little of the surface for a reliable match.",
  refused: "The frame could not be read or used.",
};
const number = (value) => (value === null || value === undefined ? "-" : value.toFixed(2));

/// The answer of the whole test as far as it is known, in words; `shown`: the verdict, by which it is colored.
export function headlineOf(result, test) {
  const { verdict, word, best, why } = answerOf(result, test);
  const shown = verdict === "matched" && test.warning ? "doubtful" : verdict, [sign, name] = verdicts[shown] ?? verdicts.unknown;
  return { shown, sign, name: word ?? name, best, why };
}

function answerOf({ verdict, matches }, { results, complete, answer }) {
  if (results === 0) return { verdict: "none", word: "No frames yet", why: "Waiting for the first frame." };
  if (answer && answer.verdict in ofTest)
    return { verdict: answer.verdict, best: answer.simulations,
      why: `${ofTest[answer.verdict]} Misfit ${number(answer.misfit)}. ${complete ? "The test is complete." : "The test so far."}` };
  if (answer) return { verdict: "none", word: "No verdict", best: answer.simulations, why: "The test's verdict needs four frames." };
  if (verdict !== "matched" && verdict !== "unknown") return { verdict, best: matches?.[0]?.name, why: ofFrame[verdict] ?? "" };
  return { verdict: "none", word: "Nearest sample", best: matches?.[0]?.name, why: "Only method fit detects that no simulation fits." };
}

/// The headline is the answer of the whole test; the latest or chosen frame is described below it.
export class VerdictPanel {
  constructor(model) {
    this.model = model;
    this.announced = "";
    this.announceAfter = 0;
  }
  update(result, test) {
    const { shown, sign, name, best, why } = headlineOf(result, test);
    byId("verdict-panel").dataset.verdict = shown;
    put("verdict-sign", sign);
    put("verdict-word", name);
    put("best", best || "-");
    put("verdict-why", why);
    put("frame-verdict", test.results > 0 ? this.frame(result) : "");
    const warning = test.warning;
    put("pose-warning", warning && `${warning[0].toUpperCase()}${warning.slice(1)}.`);
    byId("pose-warning").hidden = !warning;
    this.announce(`${this.model.name ? `${this.model.name}: ` : ""}${name}${best ? `: ${best}` : ""}`);
  }
  frame(result) {
    const { frame, verdict, status, fit, coverage } = result, best = result.matches?.[0];
    const said = verdict === "refused" && status !== "ok" ? status : verdict;
    const parts = [`Frame ${frame}: ${said.replaceAll("_", " ")}`];
    if (best) parts.push(`${best.name}, step ${best.time_step}, ${(best.time_s * 1000).toFixed(2)} ms`, `coverage ${(coverage * 100).toFixed(0)} %`);
    if (fit) parts.push(`misfit ${number(fit.misfit)}`);
    if (Number.isFinite(fit?.error_90)) parts.push(`mean error below ${number(fit.error_90)} ${this.model.unit} (90 %)`);
    if (Number.isFinite(fit?.pose_shift)) parts.push(`pose corrected by ${number(fit.pose_shift)} ${this.model.unit} and ${number(fit.pose_turn)}\u00B0`);
    return parts.join("; ");
  }
  /// Limits announcements to one in three seconds, so that a screen reader can finish each.
  announce(text) {
    const now = performance.now();
    if (text === this.announced || now < this.announceAfter) return;
    this.announced = text;
    this.announceAfter = now + 3000;
    put("announcer", text);
  }
}

const shownLeaders = 3;

/// One column per leading simulation, because there may be more parameters than fit across the screen.
export class ParameterTable {
  constructor(model) {
    this.model = model;
    this.shown = "";
  }
  /// The title of the first row, and [simulation, its text] with the best first.
  leaders(result) {
    if (result.test) return ["Share", result.test.simulations.map(([simulation, p]) => [simulation, `${(p * 100).toFixed(0)} %`])];
    const seen = new Set();
    return ["Distance", (result.matches ?? []).filter((match) => !seen.has(match.simulation) && seen.add(match.simulation)).map((match) => [match.simulation, match.distance?.toPrecision(4) ?? "-"])];
  }
  update(result) {
    const [share, all] = this.leaders(result), leaders = all.filter(([simulation]) => simulation in this.model.simulations).slice(0, shownLeaders);
    const key = JSON.stringify([share, leaders]);
    if (key === this.shown) return;
    this.shown = key;
    const simulations = leaders.map(([simulation]) => this.model.simulations[simulation]);
    byId("parameters-head").replaceChildren(this.row("th", "col", "Simulation", simulations.map(({ name }) => name)));
    byId("parameters").replaceChildren(this.row("td", "row", share, leaders.map(([, value]) => value)),
      ...this.model.parameters.map((title, i) => this.row("td", "row", title, simulations.map(({ parameters }) => (parameters[i] === null ? "-" : String(+parameters[i].toPrecision(4)))))));
  }
  row(kind, scope, title, texts) {
    const row = document.createElement("tr");
    row.append(Object.assign(document.createElement("th"), { textContent: title, scope }));
    for (const textContent of texts) row.append(Object.assign(document.createElement(kind), kind === "th" ? { textContent, scope } : { textContent }));
    return row;
  }
}

const silentRig = 1000;  // ms
const littleSpace = 1e9, littleTime = 120, longTime = 86_400;  // bytes and s: less is red; s: more is not shown

const bytesText = (bytes) => {
  const [unit, name] = [[1e12, "TB"], [1e9, "GB"], [1e6, "MB"]].find(([least]) => bytes >= least) ?? [1e6, "MB"];
  return `${(bytes / unit).toFixed(bytes < 10 * unit ? 1 : 0)} ${name}`;
};
const timeText = (seconds) => (seconds < 120 ? `${Math.floor(seconds)} s` : seconds < 7200 ? `${Math.floor(seconds / 60)} min` : `${Math.floor(seconds / 3600)} h`);

export class HealthBar {
  constructor() {
    this.cells = new Map();
  }
  cell(name, value, bad = false) {
    if (!this.cells.has(name)) {
      const box = document.createElement("div"), term = document.createElement("dt"), data = document.createElement("dd");
      term.textContent = name;
      box.append(term, data);
      byId("counters").append(box);
      this.cells.set(name, { box, data });
    }
    const { box, data } = this.cells.get(name);
    if (data.textContent !== value) data.textContent = value;
    box.classList.toggle("bad", bad);
  }
  count(name, value) {
    this.cell(name, value > 0 ? `${value.toLocaleString("en")} !` : "0", value > 0);
  }
  update(health, test) {
    const { counters } = health;
    this.cell("Received", counters.received.toLocaleString("en"));
    this.cell("Matched", counters.matched.toLocaleString("en"));
    this.count("Dropped", counters.dropped);
    this.count("Rejected", counters.rejected);
    this.count("Missed", counters.missed);
    if (counters.interleaved) this.count("Senders alternate", counters.interleaved);
    if (health.recording) this.cell("Recording", health.recording, health.recording !== "complete");
    else this.live(health, test);
    const reasons = Object.entries(counters.reasons).map(([reason, count]) => `${reason.replaceAll("_", " ")} ${count}`).join(", ");
    if (reasons || this.cells.has("Reasons")) this.cell("Reasons", reasons || "-", reasons !== "");
    for (const rig of health.rigs ?? []) this.cell(`Rig ${rig.name}`, ...this.rig(rig));
    this.latency(health.latency);
  }
  /// One of several rigs: rate or age, coverage, the pose error that is corrected, and whether results rest on it.
  rig({ rate, last_frame_ms, coverage, is_used, pose_turn, pose_shift, clock_offset_ms, clock_correction_ms, counters }) {
    const isSilent = last_frame_ms === null || last_frame_ms >= silentRig, words = [isSilent ? this.age(last_frame_ms) : `${rate.toFixed(0)} /s`];
    if (!isSilent) words.push(`${(100 * coverage).toFixed(0)} % covered`, is_used ? "used" : "NOT used");
    if (typeof pose_shift === "number") words.push(`pose off ${pose_shift.toFixed(1)}, ${pose_turn.toFixed(2)}°`);
    if (clock_offset_ms) words.push(`clock ${clock_offset_ms > 0 ? "+" : ""}${clock_offset_ms} ms`);
    if (clock_correction_ms) words.push(`clock ${Math.abs(clock_correction_ms).toFixed(1)} ms ${clock_correction_ms > 0 ? "behind" : "ahead"}, corrected`);
    if (counters.dropped > 0) words.push(`${counters.dropped.toLocaleString("en")} dropped`);
    const isBad = isSilent || !is_used || counters.dropped > 0;
    return [`${words.join(", ")}${isBad ? " !" : ""}`, isBad];
  }
  live({ counters, server, rate, last_frame_ms, results_lost_here }, test) {
    this.cell("Rate", `${rate.toFixed(rate < 10 ? 1 : 0)} /s`);
    this.cell("Queue", server ? `${server.queue_used} of ${server.queue_slots}` : "-", Boolean(server) && server.queue_used >= server.queue_slots);
    this.cell("Last frame", this.age(last_frame_ms));
    this.cell("Recording", ...this.recording(counters, server?.recording, test));
    this.cell("Disk", ...this.disk(server?.recording));
    if (results_lost_here > 0) this.cell("Lost here", results_lost_here.toLocaleString("en"));
  }
  age(ms) {
    if (ms === null) return "none";
    return ms < 1000 ? "now" : ms < 120_000 ? `${Math.floor(ms / 1000)} s ago` : `${Math.floor(ms / 60_000)} min ago`;
  }
  recording({ recorded, unrecorded, received }, recording, test) {
    if (unrecorded > 0) return [`${unrecorded.toLocaleString("en")} lost !`, true];
    if (!recording) return ["off", false];
    if (recording.phase === "failed") return ["failed !", true];
    if (recording.phase === "armed") return ["armed", false];
    if (recording.phase === "finished") return ["complete", false];
    const isWhole = test.complete && recorded >= received;  // the file is still open
    return [`${isWhole ? "all " : ""}${recorded.toLocaleString("en")} frames`, false];
  }
  /// Free space where lbea-serve records, and the remaining time at the current rate.
  disk(recording) {
    if (!recording || recording.free_bytes === null) return ["-", false];
    const { free_bytes, seconds_left } = recording, isWriting = recording.phase === "recording" && seconds_left !== null;
    const isShort = free_bytes < littleSpace || (isWriting && seconds_left < littleTime);
    return [`${bytesText(free_bytes)}${isWriting && seconds_left < longTime ? `, ${timeText(seconds_left)}` : ""}${isShort ? " !" : ""}`, isShort];
  }
  latency({ bins, first_edge_ms, p50_ms, p99_ms }) {
    put("latency-text", `Latency: half below ${p50_ms.toPrecision(2)} ms, 99 % below ${p99_ms.toPrecision(2)} ms`);
    const canvas = byId("latency"), ratio = Math.min(devicePixelRatio, 2);
    canvas.width = canvas.clientWidth * ratio;
    canvas.height = canvas.clientHeight * ratio;
    const context = canvas.getContext("2d"), most = Math.max(1, ...bins), width = canvas.width / bins.length;
    bins.forEach((count, i) => {
      const height = count === 0 ? 0 : Math.max(2, (count / most) * canvas.height);
      context.fillStyle = first_edge_ms * 2 ** (i / 2) > 100 ? style("--bad") : style("--accent");
      context.fillRect(i * width + 1, canvas.height - height, width - 2, height);
    });
  }
}
