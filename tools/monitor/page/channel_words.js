// A quantity of interest in words.
import { interval } from "./forecast.js";

/// The value with its 90 % interval, and what is not known of it. `channel`: as published with the frame, undefined when it was not.
export function channelWords(unit, channel, { doubtful, verdict, status }) {
  if (doubtful) {
    const why = verdict === "matched" || (verdict === "refused" && status !== "ok") ? status : verdict;
    return { value: "unknown", note: `(frame in doubt: ${why.replaceAll("_", " ")})` };
  }
  if (!Number.isFinite(channel?.value)) return { value: "unknown", note: "" };
  const { value, bound_90: bound } = channel, after = unit && unit !== "1" ? ` ${unit}` : "";
  if (!Number.isFinite(bound)) return { value: `${interval(value)}${after}`, note: "(interval unknown)" };
  return { value: `${interval(value, bound)}${after}`, note: "(90 %)" };
}
