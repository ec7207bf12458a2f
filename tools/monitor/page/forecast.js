// The forecast of the test's end: branches and parameters in words, as published with the shown frame.
import { byId } from "./panels.js";

const item = (name, textContent, className = "") => {
  const line = document.createElement("li"), value = document.createElement("b");
  value.textContent = textContent;
  line.append(`${name} `, value);
  line.className = className;
  return line;
};
const percent = (share) => (share >= 0.995 ? "> 99 %" : share < 0.005 ? "< 1 %" : `${(share * 100).toFixed(0)} %`);

/// "8.93 ± 0.41": with the decimals that the interval needs.
export function interval(value, bound) {
  if (!(bound > 0)) return String(+value.toPrecision(3));
  const decimals = Math.max(0, 1 - Math.floor(Math.log10(bound)));
  if (decimals > 6) return `${+value.toPrecision(3)} \u00b1 ${+bound.toPrecision(2)}`;
  return `${value.toFixed(decimals)} \u00b1 ${bound.toFixed(decimals)}`;
}

export class ForecastPanel {
  constructor(model) {
    this.model = model;
    this.shown = "";
  }
  update({ forecast }) {
    const key = JSON.stringify(forecast ?? null);
    if (key === this.shown) return;
    this.shown = key;
    byId("forecast-shape").textContent = forecast ? `Final shape within ${+forecast.error_90.toPrecision(3)} ${this.model.unit} (90 %)` : "None yet";
    const branches = (forecast?.branches ?? []).map((p, i) => [p, i]).filter(() => forecast.branches.length > 1).sort((a, b) => b[0] - a[0]).slice(0, 3);
    byId("forecast-branches").replaceChildren(...branches.map(([p, i]) => item(`Branch ${i}`, percent(p))));
    byId("forecast-parameters").replaceChildren(...this.parameters(forecast?.parameters ?? []));
  }
  /// Known ones with their 90 % intervals, then the names of the others.
  parameters(all) {
    const named = all.map((parameter, i) => [this.model.parameters[i] ?? `#${i}`, parameter]);
    const known = named.filter(([, { identifiable }]) => identifiable), unknown = named.filter(([, { identifiable }]) => !identifiable);
    const lines = known.map(([name, { value, bound_90 }]) => item(name, interval(value, bound_90)));
    if (unknown.length > 0) lines.push(item("Not identifiable from shape:", unknown.map(([name]) => name.replace(/ \[.*/, "")).join(", "), "unknown"));
    return lines;
  }
}
