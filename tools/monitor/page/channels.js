// The quantities of interest that the model names: each with its present value and its curve.
import { channelWords, endWords } from "./channel_words.js";
import { ChannelChart } from "./charts.js";
import { byId } from "./panels.js";

const made = (tag, className, textContent = "") => Object.assign(document.createElement(tag), { className, textContent });

class Card {
  constructor({ name, unit }) {
    Object.assign(this, { name, unit });
    this.element = made("li", "channel");
    this.value = made("b", "", "-");
    this.note = made("span", "unknown");
    this.end = made("p", "channel-end");
    const words = made("p", "channel-words"), chart = made("div", "chart");
    words.append(this.value, " ", this.note);
    chart.setAttribute("role", "img");
    chart.setAttribute("aria-label", `${name} over time, with its 90 % interval`);
    this.element.append(Object.assign(made("h3", "", name), { title: name }), words, this.end, chart);
    this.chart = new ChannelChart(chart, name);
  }
  update(channel, result) {
    const { value, note } = channelWords(this.unit, channel, result);
    if (this.value.textContent !== value) this.value.textContent = value;
    if (this.note.textContent !== note) this.note.textContent = note;
    const end = endWords(this.unit, channel, result);
    if (this.end.textContent !== end) this.end.textContent = end;
    this.value.classList.toggle("unknown", value === "unknown");
  }
}

export class ChannelPanel {
  /// `appeared`: called when a curve comes into view. Only those in view are drawn: a model may have 1,024.
  constructor(channels, appeared) {
    byId("channels-panel").hidden = channels.length === 0;
    this.cards = channels.map((channel) => new Card(channel));
    byId("channels").replaceChildren(...this.cards.map(({ element }) => element));
    this.inView = new Set();
    this.observer = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) this.inView[isIntersecting ? "add" : "delete"](target);
      appeared();
    });
    for (const { element } of this.cards) this.observer.observe(element);
  }
  /// Before another panel takes its place.
  close() {
    this.observer.disconnect();
  }
  /// Shows the values of a frame.
  update(result) {
    const published = new Map((result.channels ?? []).map((channel) => [channel.name, channel]));
    for (const card of this.cards) card.update(published.get(card.name), result);
  }
  draw(rows, now) {
    for (const { chart, element } of this.cards) if (this.inView.has(element)) chart.update(rows, now);
  }
}
