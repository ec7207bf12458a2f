// The joint low-dimensional view: a curve for each simulation, and the path of the test. It projects three coordinates to the
// plane in which the curves spread most, scaled to fill the canvas.
import { colorOf, style } from "./colors.js";

const rounds = 60;  // of the power iteration

const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);
const normalized = (a) => a.map((value) => value / (Math.hypot(...a) || 1));

/// The two leading eigenvectors of the covariance of 3D points, by power iteration: orthogonal, of unit length.
function principalAxes(points) {
  const mean = [0, 1, 2].map((k) => points.reduce((sum, point) => sum + point[k], 0) / Math.max(1, points.length));
  const covariance = [0, 1, 2].map((i) => [0, 1, 2].map((j) => points.reduce((sum, point) => sum + (point[i] - mean[i]) * (point[j] - mean[j]), 0)));
  const axes = [];
  for (let k = 0; k < 2; ++k) {
    let axis = normalized([1, 0.61 + k, 0.37 - k]);
    for (let round = 0; round < rounds; ++round) {
      let next = covariance.map((row) => dot(row, axis));
      for (const found of axes) next = next.map((value, i) => value - dot(next, found) * found[i]);
      if (Math.hypot(...next) === 0) break;
      axis = normalized(next);
    }
    // The sign is arbitrary; make the largest component positive.
    const largest = axis.reduce((best, value) => (Math.abs(value) > Math.abs(best) ? value : best), 0);
    axes.push(largest < 0 ? axis.map((value) => -value) : axis);
  }
  return axes;
}

export class Plane {
  constructor(canvas, model) {
    this.canvas = canvas;
    this.backdrop = document.createElement("canvas");
    this.take(model);
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
  }
  take({ curves, axes }) {
    this.axes = axes.map((place) => `mode ${Math.floor(place / 3) + 1} ${"xyz"[place % 3]}`);
    this.lines = new Map();
    const points = [];
    for (let i = 0; i < curves.length; i += 5) {
      if (!this.lines.has(curves[i])) this.lines.set(curves[i], []);
      points.push([curves[i + 2], curves[i + 3], curves[i + 4]]);
      this.lines.get(curves[i]).push(points.at(-1));
    }
    this.directions = principalAxes(points);
    const spread = (k) => points.map((point) => this.along(point, k));
    this.ranges = [0, 1].map((k) => [Math.min(...spread(k)), Math.max(...spread(k))]);
    this.path = [];
    this.leader = -1;
  }
  resize() {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    const ratio = Math.min(devicePixelRatio, 2);
    for (const canvas of [this.canvas, this.backdrop]) {
      canvas.width = Math.max(1, clientWidth * ratio);
      canvas.height = Math.max(1, clientHeight * ratio);
    }
    this.recolor();
  }
  recolor() {
    this.drawBackdrop();
    this.draw();
  }
  along(point, k) {
    return point.reduce((sum, value, i) => sum + value * this.directions[k][i], 0);
  }
  at(point) {
    const { width, height } = this.canvas, margin = 0.1 * height;
    const [u, v] = this.ranges.map(([lo, hi], k) => (hi > lo ? (this.along(point, k) - lo) / (hi - lo) : 0.5));
    return [margin + u * (width - 2 * margin), height - margin - v * (height - 2 * margin)];
  }
  stroke(context, points, color, width, alpha) {
    context.beginPath();
    points.forEach((point, i) => context[i === 0 ? "moveTo" : "lineTo"](...this.at(point)));
    Object.assign(context, { strokeStyle: color, lineWidth: width, globalAlpha: alpha, lineJoin: "round" });
    context.stroke();
    context.globalAlpha = 1;
  }
  drawBackdrop() {
    const context = this.backdrop.getContext("2d"), unit = this.backdrop.height / 200;
    context.clearRect(0, 0, this.backdrop.width, this.backdrop.height);
    this.drawAxes(context, unit);
    for (const [simulation, points] of this.lines) this.stroke(context, points, colorOf(simulation), 1.1 * unit, 0.6);
  }
  /// The direction of each coordinate, from a common origin in a corner.
  drawAxes(context, unit) {
    context.font = `${10 * unit}px sans-serif`;
    context.fillStyle = style("--soft");
    const [x, y] = this.emptiestCorner(70 * unit, 45 * unit);
    this.axes.forEach((name, k) => {
      const step = [0, 1].map((d) => this.directions[d][k] / Math.max(this.ranges[d][1] - this.ranges[d][0], 1e-30));
      const length = Math.hypot(...step) || 1;
      const [u, v] = [x + (28 * unit * step[0]) / length, y - (28 * unit * step[1]) / length];
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(u, v);
      Object.assign(context, { strokeStyle: style("--soft"), lineWidth: unit });
      context.stroke();
      const wide = context.measureText(name).width, beside = u < x ? u - wide - 2 * unit : u + 2 * unit;
      context.fillText(name, Math.min(Math.max(beside, 0), this.canvas.width - wide), v + (v > y ? 8 : -1) * unit);
    });
  }
  /// The corner with the fewest points of the curves.
  emptiestCorner(across, up) {
    const points = [...this.lines.values()].flat().map((point) => this.at(point));
    const corners = [[across, up], [across, this.canvas.height - up], [this.canvas.width - across, up], [this.canvas.width - across, this.canvas.height - up]];
    const crowd = ([x, y]) => points.filter(([u, v]) => Math.abs(u - x) < across && Math.abs(v - y) < up).length;
    return corners.map((corner) => [crowd(corner), corner]).reduce((best, next) => (next[0] < best[0] ? next : best))[1];
  }
  /// `now`: coordinates of the displayed frame of a recording; undefined: the end of the path.
  update(rows, leader, now) {
    this.path = [];
    for (let r = 0; r < rows.count; ++r) {
      const point = [rows.at(r, "x"), rows.at(r, "y"), rows.at(r, "z")];
      if (!point.some(Number.isNaN)) this.path.push(point);
    }
    this.leader = leader;
    this.now = now ?? this.path.at(-1);
    this.draw();
  }
  draw() {
    const context = this.canvas.getContext("2d"), unit = this.canvas.height / 200;
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.drawImage(this.backdrop, 0, 0);
    if (this.lines.has(this.leader)) this.stroke(context, this.lines.get(this.leader), colorOf(this.leader), 3 * unit, 1);
    if (this.path.length === 0) return;
    this.stroke(context, this.path, style("--ink"), 2 * unit, 1);
    const [x, y] = this.at(this.now);
    context.beginPath();
    context.arc(x, y, 4.5 * unit, 0, 2 * Math.PI);
    context.fillStyle = style("--mark");
    context.fill();
    context.strokeStyle = style("--ink");
    context.lineWidth = unit;
    context.stroke();
  }
}
