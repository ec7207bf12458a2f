// The rows of the curves, as the server keeps them. When it thins them, it sends all rows again with a new epoch.
export class Rows {
  epoch = -1;
  count = 0;
  width = 0;  // values of a row: named columns, then pairs of a simulation and its probability
  columns = [];
  values = new Float32Array(0);

  add({ head, arrays }) {
    if (head.epoch !== this.epoch) {
      this.epoch = head.epoch;
      this.count = 0;
    }
    if (head.first !== this.count) return;
    this.width = head.row_values;
    this.columns = head.columns;
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
    return this.values[row * this.width + this.columns.indexOf(name)];
  }
  /// The probability of a simulation; null when it is not among the most probable ones of the row.
  chance(row, simulation) {
    for (const [likely, probability] of this.chances(row)) if (likely === simulation) return probability;
    return null;
  }
  /// The most probable simulations of the row, with their probabilities.
  *chances(row) {
    for (let at = row * this.width + this.columns.length; at < (row + 1) * this.width && !Number.isNaN(this.values[at]); at += 2)
      yield [this.values[at], this.values[at + 1]];
  }
  hasChances(row) {
    return !this.chances(row).next().done;
  }
}
