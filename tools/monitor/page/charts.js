// Curves over the time of the test.
import uPlot from "uplot";
import { colorOf, style } from "./colors.js";

const shownSimulations = 6;
const mostPoints = 1200;  // of a curve: more points than the chart has pixels are not visible

function* shownRows(rows) {
  const step = Math.max(1, Math.ceil(rows.count / mostPoints));
  for (let r = (rows.count - 1) % step; r < rows.count; r += step) yield r;
}

function rem() {
  return parseFloat(getComputedStyle(document.documentElement).fontSize);
}

class Chart {
  constructor(element) {
    this.element = element;
    this.plot = null;
    this.key = "";
    new ResizeObserver(() => this.plot?.setSize(this.size())).observe(element);
  }
  size() {
    return { width: Math.max(80, this.element.clientWidth), height: Math.max(60, this.element.clientHeight) };
  }
  axis(more) {
    const size = rem();
    return { stroke: style("--ink"), font: `${0.9 * size}px sans-serif`, space: 3.5 * size, size: 4 * size, gap: 0.2 * size,
      grid: { stroke: style("--line"), width: 1 }, ticks: { stroke: style("--line"), width: 1 }, ...more };
  }
  timeAxis() {
    return this.axis({ space: 5 * rem(), size: 2.2 * rem(), values: (_, splits) => splits.map((t) => `${+(t * 1000).toPrecision(6)} ms`) });
  }
  /// Marks the displayed frame of a recording.
  mark({ ctx, bbox }) {
    if (this.now === undefined) return;
    const x = this.plot.valToPos(this.now, "x", true), unit = rem() / 8 * devicePixelRatio;
    ctx.fillStyle = style("--mark");
    ctx.fillRect(x - unit / 2, bbox.top, unit, bbox.height);
  }
  /// Creates the plot again when `key` has changed. `now`: time in s of the displayed frame; undefined for a running test.
  set(key, options, data, now) {
    this.now = now;
    key += `${style("--ink")}${rem()}`;
    if (key !== this.key) {
      this.plot?.destroy();
      this.key = key;
      this.plot = new uPlot({ ...this.size(), padding: [null, 1.4 * rem(), null, null], hooks: { draw: [(plot) => this.plot === plot && this.mark(plot)] }, cursor: { show: false }, legend: { show: false }, ...options() }, data, this.element);
    } else this.plot.setData(data);
  }
}

export class ProbabilityChart extends Chart {
  constructor(element, list, nameOf) {
    super(element);
    Object.assign(this, { list, nameOf });
  }
  /// The simulations with the largest area in the chart, by their indices.
  leaders(rows) {
    const weight = new Map(), step = Math.max(1, Math.floor(rows.count / 512));
    for (let r = rows.count - 1; r >= 0; r -= step)
      for (const [simulation, probability] of rows.chances(r)) weight.set(simulation, (weight.get(simulation) ?? 0) + probability);
    return [...weight].sort((a, b) => b[1] - a[1]).slice(0, shownSimulations).map(([simulation]) => simulation).sort((a, b) => a - b);
  }
  update(rows, now) {
    const simulations = this.leaders(rows);
    const data = [[], ...simulations.map(() => [])];
    for (const r of shownRows(rows)) {
      if (!rows.hasChances(r)) continue;
      data[0].push(rows.at(r, "time_s"));
      let sum = 0;
      simulations.forEach((simulation, i) => data[i + 1].push((sum += rows.chance(r, simulation) ?? 0)));
    }
    const options = () => ({
      scales: { x: { time: false }, y: { range: [0, 1] } },
      axes: [this.timeAxis(), this.axis({ values: (_, splits) => splits.map((p) => `${Math.round(p * 100)} %`) })],
      series: [{}, ...simulations.map((simulation) => ({ stroke: colorOf(simulation), fill: colorOf(simulation), width: 1, points: { show: false } }))],
    });
    // Drawn from the highest sum down, so that every band is visible.
    const reversed = [data[0], ...data.slice(1).reverse()];
    this.set(simulations.join(), () => {
      const made = options();
      return { ...made, series: [made.series[0], ...made.series.slice(1).reverse()] };
    }, reversed, now);
    this.note(simulations, rows);
  }
  note(simulations, rows) {
    const last = rows.count - 1;
    const entries = simulations.map((simulation) => [colorOf(simulation), this.nameOf(simulation), last >= 0 ? (rows.chance(last, simulation) ?? 0) : 0]);
    this.list.replaceChildren(...entries.sort((a, b) => b[2] - a[2]).slice(0, 4).map(([color, name, p]) => {
      const item = document.createElement("li");
      const key = document.createElement("span");
      key.textContent = "\u25A0 ";
      key.style.color = color;
      item.append(key, `${name} ${(p * 100).toFixed(0)} %`);
      return item;
    }));
    if (rows.count > 0 && simulations.length === 0) this.list.replaceChildren(Object.assign(document.createElement("li"), { textContent: "Only method fit computes probabilities." }));
  }
}

/// How far the forecast final shape may be wrong: the interval from 0 to its 90 % bound.
export class ForecastChart extends Chart {
  constructor(element, unit) {
    super(element);
    this.unit = unit;
  }
  update(rows, now) {
    const data = [[], []];
    for (const r of shownRows(rows)) {
      const bound = rows.at(r, "final_error_90");
      data[0].push(rows.at(r, "time_s"));
      data[1].push(Number.isNaN(bound) ? null : bound);
    }
    this.set("forecast", () => ({
      scales: { x: { time: false }, y: { range: (_, lo, hi) => [0, Math.max(hi * 1.05, 1e-6)] } },
      axes: [this.timeAxis(), this.axis({ space: 2 * rem(), values: (_, splits) => splits.map((d) => `${+d.toPrecision(3)} ${this.unit}`), size: 5 * rem() })],
      series: [{}, { stroke: style("--final"), fill: `${style("--final")}33`, width: rem() / 5, points: { show: rows.count < 60, size: rem() / 2 } }],
    }), data, now);
  }
}

const orNull = (value) => (Number.isNaN(value) ? null : value);

/// A quantity of interest with its 90 % interval. Doubtful frames leave gaps.
export class ChannelChart extends Chart {
  constructor(element, name) {
    super(element);
    this.name = name;
  }
  update(rows, now) {
    const data = [[], [], [], []];
    for (const r of shownRows(rows)) {
      const [value, bound] = rows.channel(r, this.name);
      data[0].push(rows.at(r, "time_s"));
      data[1].push(orNull(value + bound));
      data[2].push(orNull(value - bound));
      data[3].push(orNull(value));
    }
    const edge = { stroke: style("--accent"), width: 0, points: { show: false } };
    this.set("channel", () => ({
      scales: { x: { time: false } },
      axes: [this.timeAxis(), this.axis({ space: 1.5 * rem(), values: (_, splits) => splits.map((value) => String(+value.toPrecision(3))), size: 4.5 * rem() })],
      series: [{}, edge, edge, { stroke: style("--accent"), width: rem() / 5, points: { show: rows.count < 60, size: rem() / 2 } }],
      bands: [{ series: [1, 2], fill: `${style("--accent")}40` }],
    }), data, now);
  }
}

export class DistanceChart extends Chart {
  constructor(element, title, unit) {
    super(element);
    Object.assign(this, { title, unit });
  }
  update(rows, now) {
    const data = [[], [], []];
    let byFit = false;
    for (const r of shownRows(rows)) byFit ||= !Number.isNaN(rows.at(r, "residual"));
    for (const r of shownRows(rows)) {
      const distance = rows.at(r, byFit ? "residual" : "distance"), coverage = rows.at(r, "coverage");
      data[0].push(rows.at(r, "time_s"));
      data[1].push(Number.isNaN(distance) ? null : distance);
      data[2].push(Number.isNaN(coverage) ? null : coverage * 100);
    }
    this.setTitle(byFit ? `Residual (${this.unit})` : "Distance");
    this.set(`${byFit}`, () => ({
      scales: { x: { time: false }, d: { range: (_, lo, hi) => [0, Math.max(hi * 1.05, 1e-6)] }, c: { range: [0, 105] } },
      axes: [this.timeAxis(), this.axis({ scale: "d", stroke: style("--accent") }), this.axis({ scale: "c", side: 1, stroke: style("--good"), grid: { show: false } })],
      series: [{}, { scale: "d", stroke: style("--accent"), width: rem() / 5, points: { show: rows.count < 60, size: rem() / 2 } },
        { scale: "c", stroke: style("--good"), width: rem() / 5, dash: [rem() / 1.6, rem() / 2.6], points: { show: false } }],
    }), data, now);
  }
  /// Shows the title in the colors and strokes of the curves.
  setTitle(distance) {
    const parts = [[distance, "solid-key"], [" and ", ""], ["coverage (%)", "dashed-key"]];
    if (this.title.textContent === parts.map(([text]) => text).join("")) return;
    this.title.replaceChildren(...parts.map(([textContent, className]) => Object.assign(document.createElement("span"), { textContent, className })));
  }
}
