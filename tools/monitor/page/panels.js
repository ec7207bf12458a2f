// Verdict, best simulation, parameters, health: in words and numbers.
import { style } from "./colours.js";

const byId = (id) => document.getElementById(id);
const put = (id, text) => {
  const element = byId(id);
  if (element.textContent !== text) element.textContent = text;
};

const verdicts = {
  matched: ["\u2713", "Matched", "One shape explains the frame."],
  ambiguous: ["?", "Ambiguous", "Simulations with clearly different shapes explain the frame alike."],
  no_simulation_fits: ["\u2715", "No simulation fits", "The frame lies beyond what the ensemble explains."],
  low_coverage: ["\u25D0", "Too little seen", "The frame shows too little of the surface to be trusted."],
  refused: ["\u2715", "Frame refused", "The frame could not be read or used."],
  unknown: ["\u2013", "No verdict", "Nothing was said of this frame."],
};

export class VerdictPanel {
  constructor(model) {
    this.model = model;
    this.announced = "";
    this.announceAfter = 0;
  }
  update(result, test) {
    const matches = result.matches ?? [], best = matches[0];
    const known = test.results > 0 ? verdicts[result.verdict] ?? verdicts.unknown : ["\u2013", "No frames yet", "Waiting for the first frame."];
    byId("verdict-panel").dataset.verdict = test.results > 0 ? result.verdict : "none";
    put("verdict-sign", known[0]);
    put("verdict-word", known[1]);
    put("verdict-why", this.why(result, known[2]) + (test.complete ? " The test is complete." : ""));
    put("best-name", best ? best.name : "-");
    put("best-step", best ? `step ${best.time_step}, ${(best.time_s * 1000).toFixed(2)} ms` : "");
    put("test-so-far", this.soFar(result.test));
    this.announce(`${known[1]}${best ? `: ${best.name}` : ""}`);
  }
  /// What all frames together say may differ from what the last one says.
  soFar(test) {
    if (!test || !test.simulations.length) return "";
    const [simulation, probability] = test.simulations[0];
    return `Whole test so far: ${this.model.simulations[simulation]?.name ?? simulation} (${(probability * 100).toFixed(0)} %)`;
  }
  why(result, sentence) {
    if (result.status !== "ok" && result.verdict === "refused") return `${sentence} Reason: ${result.status.replaceAll("_", " ")}.`;
    if (!result.fit) return result.verdict === "matched" ? "The nearest sample; only method fit can say that none fits." : sentence;
    const { misfit, spread } = result.fit;
    const number = (value) => (value === null || value === undefined ? "-" : value.toFixed(2));
    return `${sentence} Misfit ${number(misfit)}, spread ${number(spread)} ${this.model.unit}.`;
  }
  /// Not every frame: a screen reader would never come to an end.
  announce(text) {
    const now = performance.now();
    if (text === this.announced || now < this.announceAfter) return;
    this.announced = text;
    this.announceAfter = now + 3000;
    put("announcer", text);
  }
}

export class ParameterTable {
  constructor(model) {
    this.model = model;
    this.shown = "";
    const row = document.createElement("tr");
    for (const title of ["Simulation", "Share", ...model.parameters]) row.append(Object.assign(document.createElement("th"), { textContent: title, scope: "col" }));
    byId("parameters-head").replaceChildren(row);
  }
  leaders(result) {
    if (result.test) return result.test.simulations.slice(0, 6).map(([simulation, p]) => [simulation, `${(p * 100).toFixed(0)} %`]);
    const seen = new Set();
    return (result.matches ?? []).filter((match) => !seen.has(match.simulation) && seen.add(match.simulation)).map((match) => [match.simulation, match.distance.toPrecision(4)]);
  }
  update(result) {
    const leaders = this.leaders(result), key = JSON.stringify(leaders);
    if (key === this.shown) return;
    this.shown = key;
    byId("parameters").replaceChildren(...leaders.filter(([simulation]) => simulation in this.model.simulations).map(([simulation, share]) => {
      const row = document.createElement("tr"), { name, parameters } = this.model.simulations[simulation];
      row.append(Object.assign(document.createElement("th"), { textContent: name, scope: "row" }));
      for (const value of [share, ...parameters.map((p) => (p === null ? "-" : String(+p.toPrecision(5))))])
        row.append(Object.assign(document.createElement("td"), { textContent: value }));
      return row;
    }));
  }
}

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
    const { counters, server } = health;
    this.cell("Received", counters.received.toLocaleString("en"));
    this.cell("Matched", counters.matched.toLocaleString("en"));
    this.count("Dropped", counters.dropped);
    this.count("Rejected", counters.rejected);
    this.count("Never came", counters.missed);
    this.cell("Rate", `${health.rate.toFixed(health.rate < 10 ? 1 : 0)} /s`);
    this.cell("Queue", server ? `${server.queue_used} of ${server.queue_slots}` : "-", Boolean(server) && server.queue_used >= server.queue_slots);
    this.cell("Last frame", this.age(health.last_frame_ms));
    this.cell("Recording", ...(health.recording ? [health.recording, health.recording !== "complete"] : this.recording(counters, test)));
    if (health.results_lost_here > 0) this.cell("Not shown here", health.results_lost_here.toLocaleString("en"));
    const reasons = Object.entries(counters.reasons).map(([reason, count]) => `${reason.replaceAll("_", " ")} ${count}`).join(", ");
    if (reasons || this.cells.has("Reasons")) this.cell("Reasons", reasons || "-", reasons !== "");
    this.latency(health.latency);
  }
  age(ms) {
    if (ms === null) return "none";
    return ms < 1000 ? "now" : ms < 120_000 ? `${Math.floor(ms / 1000)} s ago` : `${Math.floor(ms / 60_000)} min ago`;
  }
  recording({ recorded, unrecorded, received }, test) {
    if (unrecorded > 0) return [`${unrecorded.toLocaleString("en")} lost !`, true];
    if (recorded === 0) return ["off", false];
    if (test.complete && recorded >= received) return ["complete", false];
    return [`${recorded.toLocaleString("en")} frames`, false];
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
