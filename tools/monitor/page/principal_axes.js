// The directions in which points in space spread most.
const rounds = 60;

const dot = (a, b) => a.reduce((sum, value, i) => sum + value * b[i], 0);
const normalised = (a) => a.map((value) => value / (Math.hypot(...a) || 1));

/// Two of them, of unit length, at right angles: the leading eigenvectors of the covariance, by power iteration.
export function principalAxes(points) {
  const mean = [0, 1, 2].map((k) => points.reduce((sum, point) => sum + point[k], 0) / Math.max(1, points.length));
  const covariance = [0, 1, 2].map((i) => [0, 1, 2].map((j) => points.reduce((sum, point) => sum + (point[i] - mean[i]) * (point[j] - mean[j]), 0)));
  const axes = [];
  for (let k = 0; k < 2; ++k) {
    let axis = normalised([1, 0.61 + k, 0.37 - k]);
    for (let round = 0; round < rounds; ++round) {
      let next = covariance.map((row) => dot(row, axis));
      for (const found of axes) next = next.map((value, i) => value - dot(next, found) * found[i]);
      if (Math.hypot(...next) === 0) break;
      axis = normalised(next);
    }
    // Whichever way round: the largest component positive.
    const largest = axis.reduce((best, value) => (Math.abs(value) > Math.abs(best) ? value : best), 0);
    axes.push(largest < 0 ? axis.map((value) => -value) : axis);
  }
  return axes;
}
