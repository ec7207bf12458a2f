// The chooser of several components: which ones the view shows, and whose verdict and curves the panels show.
import { byId, headlineOf } from "./panels.js";

const made = (tag, properties, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};

export class ComponentChooser {
  /// `changed`: the shown ones have changed; `chosen`: called with the number of the one in front.
  constructor(names, { changed, chosen }) {
    byId("components").hidden = names.length < 2;
    this.rows = names.map((name, i) => {
      const shown = made("input", { type: "checkbox", checked: true, ariaLabel: `Show ${name}` });
      const front = made("input", { type: "radio", name: "front", checked: i === 0 });
      const verdict = made("span", { className: "component-verdict" });
      shown.addEventListener("change", changed);
      front.addEventListener("change", () => chosen(i));
      return { shown, front, verdict, line: made("li", {}, shown, " ", made("label", {}, front, " ", made("b", { textContent: name }), " ", verdict)) };
    });
    byId("component-list").replaceChildren(...this.rows.map(({ line }) => line));
  }
  isShown(i) {
    return this.rows[i].shown.checked;
  }
  /// heads: of each component.
  update(heads) {
    this.rows.forEach(({ verdict, line }, i) => {
      const { shown, sign, name, best } = headlineOf(heads[i].result, heads[i].test), text = `${sign} ${name}${best ? `: ${best}` : ""}`;
      line.dataset.verdict = shown;
      if (verdict.textContent !== text) verdict.textContent = text;
    });
  }
}
