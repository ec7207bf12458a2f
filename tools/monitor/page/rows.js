// The rows of the curves, as the server keeps them. When it thins them, it sends all rows again with a new epoch.
const base = ["time_s", "frame", "verdict", "status", "simulation", "time_step", "distance", "residual", "estimate_residual", "misfit", "spread",
  "coverage", "x", "y", "z", "latency_ms"];
export const column = Object.fromEntries(base.map((name, i) => [name, i]));
export const firstChance = base.length, chances = 8;

export class Rows {
  epoch = -1;
  count = 0;
  width = firstChance + 2 * chances;
  values = new Float32Array(0);

  add({ head, arrays }) {
    if (head.epoch !== this.epoch) {
      this.epoch = head.epoch;
      this.count = 0;
    }
    if (head.first !== this.count) return;
    this.width = head.row_values;
    const end = this.count * this.width + arrays.rows.length;
    if (end > this.values.length) {
      const grown = new Float32Array(Math.max(end, 2 * this.values.length, 4096));
      grown.set(this.values.subarray(0, this.count * this.width));
      this.values = grown;
    }
    this.values.set(arrays.rows, this.count * this.width);
    this.count = end / this.width;
  }
  at(row, name) {
    return this.values[row * this.width + column[name]];
  }
  /// The probability of a simulation; null when it is not among the most probable ones of the row.
  chance(row, simulation) {
    const begin = row * this.width + firstChance;
    for (let k = 0; k < chances; ++k) if (this.values[begin + 2 * k] === simulation) return this.values[begin + 2 * k + 1];
    return null;
  }
  hasChances(row) {
    return !Number.isNaN(this.values[row * this.width + firstChance]);
  }
}
