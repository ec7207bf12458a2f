// A quantity of interest in words.
import { interval } from "./forecast.js";

const withUnit = (unit, value, bound) => `${interval(value, bound)}${unit && unit !== "1" ? ` ${unit}` : ""}`;

/// What the frame forecasts of the value at the end of the test; "" without a forecast.
export function endWords(unit, channel, { doubtful }) {
  if (doubtful || !Number.isFinite(channel?.end_value)) return "";
  return `At the end: ${withUnit(unit, channel.end_value, channel.end_bound_90)}`;
}

/// The value with its 90 % interval, and what is not known of it. `channel`: as published with the frame, undefined when it was not.
export function channelWords(unit, channel, { doubtful, verdict, status }) {
  if (doubtful) {
    const why = verdict === "matched" || (verdict === "refused" && status !== "ok") ? status : verdict;
    return { value: "unknown", note: `(frame in doubt: ${why.replaceAll("_", " ")})` };
  }
  if (!Number.isFinite(channel?.value)) return { value: "unknown", note: "" };
  const { value, bound_90: bound } = channel;
  if (!Number.isFinite(bound)) return { value: withUnit(unit, value), note: "(interval unknown)" };
  return { value: withUnit(unit, value, bound), note: "(90 %)" };
}
