// The joint low-dimensional view: every simulation a curve, the test its path among them. Three coordinates, drawn obliquely.
import { colourOf, style } from "./colours.js";

const depth = [0.38, 0.26];  // how far the third axis leans

export class Plane {
  constructor(canvas, curves, axes) {
    this.canvas = canvas;
    this.axes = axes.map((place) => `mode ${Math.floor(place / 3) + 1} ${"xyz"[place % 3]}`);
    this.lines = new Map();
    this.lo = [Infinity, Infinity, Infinity];
    this.hi = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < curves.length; i += 5) {
      if (!this.lines.has(curves[i])) this.lines.set(curves[i], []);
      const point = [curves[i + 2], curves[i + 3], curves[i + 4]];
      this.lines.get(curves[i]).push(point);
      point.forEach((value, k) => {
        this.lo[k] = Math.min(this.lo[k], value);
        this.hi[k] = Math.max(this.hi[k], value);
      });
    }
    this.path = [];
    this.leader = -1;
    this.backdrop = document.createElement("canvas");
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.resize();
  }
  resize() {
    const { clientWidth, clientHeight } = this.canvas.parentElement;
    const ratio = Math.min(devicePixelRatio, 2);
    for (const canvas of [this.canvas, this.backdrop]) {
      canvas.width = Math.max(1, clientWidth * ratio);
      canvas.height = Math.max(1, clientHeight * ratio);
    }
    this.recolour();
  }
  recolour() {
    this.drawBackdrop();
    this.draw();
  }
  at(point) {
    const [x, y, z] = point.map((value, k) => (this.hi[k] > this.lo[k] ? (value - this.lo[k]) / (this.hi[k] - this.lo[k]) : 0.5));
    const { width, height } = this.canvas, margin = 0.08 * height;
    const u = (x + depth[0] * z) / (1 + depth[0]), v = (y + depth[1] * z) / (1 + depth[1]);
    return [margin + u * (width - 2 * margin), height - margin - v * (height - 2 * margin)];
  }
  stroke(context, points, colour, width, alpha) {
    context.beginPath();
    points.forEach((point, i) => context[i === 0 ? "moveTo" : "lineTo"](...this.at(point)));
    Object.assign(context, { strokeStyle: colour, lineWidth: width, globalAlpha: alpha, lineJoin: "round" });
    context.stroke();
    context.globalAlpha = 1;
  }
  drawBackdrop() {
    const context = this.backdrop.getContext("2d"), unit = this.backdrop.height / 200;
    context.clearRect(0, 0, this.backdrop.width, this.backdrop.height);
    const origin = this.lo, ends = [0, 1, 2].map((k) => origin.map((value, i) => (i === k ? this.hi[k] : value)));
    context.font = `${Math.max(10, 9 * unit)}px sans-serif`;
    ends.forEach((end, k) => {
      this.stroke(context, [origin, end], style("--line"), unit, 1);
      const [x, y] = this.at(end);
      context.fillStyle = style("--soft");
      context.textAlign = k === 1 ? "left" : "right";
      context.fillText(this.axes[k], x + (k === 1 ? 4 * unit : 0), y - 2 * unit);
    });
    for (const [simulation, points] of this.lines) this.stroke(context, points, colourOf(simulation), 1.1 * unit, 0.6);
  }
  update(rows, leader) {
    this.path = [];
    for (let r = 0; r < rows.count; ++r) {
      const point = [rows.at(r, "x"), rows.at(r, "y"), rows.at(r, "z")];
      if (!point.some(Number.isNaN)) this.path.push(point);
    }
    this.leader = leader;
    this.draw();
  }
  draw() {
    const context = this.canvas.getContext("2d"), unit = this.canvas.height / 200;
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.drawImage(this.backdrop, 0, 0);
    if (this.lines.has(this.leader)) this.stroke(context, this.lines.get(this.leader), colourOf(this.leader), 3 * unit, 1);
    if (this.path.length === 0) return;
    this.stroke(context, this.path, style("--ink"), 2 * unit, 1);
    const [x, y] = this.at(this.path.at(-1));
    context.beginPath();
    context.arc(x, y, 4.5 * unit, 0, 2 * Math.PI);
    context.fillStyle = style("--mark");
    context.fill();
    context.strokeStyle = style("--ink");
    context.lineWidth = unit;
    context.stroke();
  }
}
