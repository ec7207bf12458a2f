// The rows of the curves, as the server keeps them. When it thins them, it sends all rows again with a new epoch.
/// `values`, of which `used` are valid, with `more` after these; grown when necessary.
function appended(values, used, more) {
  const end = used + more.length;
  if (end > values.length) {
    const grown = new Float32Array(Math.max(end, 2 * values.length, 4096));
    grown.set(values.subarray(0, used));
    values = grown;
  }
  values.set(more, used);
  return values;
}

export class Rows {
  epoch = -1;
  count = 0;
  width = 0;  // values of a row: named columns, then pairs of a simulation and its probability
  columns = [];
  values = new Float32Array(0);
  channels = new Map();  // name -> place
  channelValues = new Float32Array(0);  // rows x channels x 2: value, 90 % bound

  add({ head, arrays }) {
    if (head.epoch !== this.epoch) {
      this.epoch = head.epoch;
      this.count = 0;
    }
    if (head.first !== this.count) return;
    this.width = head.row_values;
    this.columns = head.columns;
    if (head.channels) this.channels = new Map(head.channels.map(({ name }, i) => [name, i]));
    this.values = appended(this.values, this.count * this.width, arrays.rows);
    this.channelValues = appended(this.channelValues, this.count * this.channels.size * 2, arrays.channels);
    this.count += arrays.rows.length / this.width;
  }
  /// The value of a quantity of interest and its 90 % bound; NaN: unknown.
  channel(row, name) {
    const at = 2 * (row * this.channels.size + (this.channels.get(name) ?? NaN));
    return [this.channelValues[at] ?? NaN, this.channelValues[at + 1] ?? NaN];
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
