#include "tools/serve/tally.hpp"

#include <nlohmann/json.hpp>

namespace lbea {

namespace {

template <class Visit>
void for_each_status(Fate fate, Visit visit) {
  for (std::size_t i = 0; i < wire_status_count; ++i) {
    if (const auto status = static_cast<WireStatus>(i); fate_of(status) == fate) visit(status);
  }
}

std::string reasons(const Counters& counters, Fate fate) {
  std::string text;
  for_each_status(fate, [&](WireStatus status) {
    if (counters.of(status) == 0) return;
    text += (text.empty() ? " (" : ", ") + std::string(to_string(status)) + " " +
            std::to_string(counters.of(status));
  });
  return std::to_string(counters.sum(fate)) + text + (text.empty() ? "" : ")");
}

std::string silence(const Counters& counters) {
  if (counters.silent == 0) return {};
  return " (" + std::to_string(counters.silent) + " gone without goodbye: what they held back is unknown)";
}

std::string recording_text(const Counters& counters) {
  if (counters.recorded == 0 && counters.unrecorded == 0) return {};
  return "; recorded " + std::to_string(counters.recorded) + ", NOT recorded " + std::to_string(counters.unrecorded);
}

nlohmann::ordered_json by_reason(const Counters& counters, Fate fate) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for_each_status(fate,
                  [&](WireStatus status) { json[std::string(to_string(status))] = counters.of(status); });
  return json;
}

}  // namespace

std::string tally_line(const Counters& counters) {
  return "captured " + std::to_string(counters.captured()) + (counters.adds_up() ? " = " : " IS NOT ") +
         "matched " + reasons(counters, Fate::matched) + " + rejected " + reasons(counters, Fate::rejected) +
         " + dropped " + reasons(counters, Fate::dropped) + "; received " + std::to_string(counters.received) +
         ", reordered " + std::to_string(counters.reordered) + ", sessions " + std::to_string(counters.sessions) +
         silence(counters) + recording_text(counters);
}

std::string tally_json(const Counters& counters) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();  // the library's null that becomes one cannot be destroyed when memory is out
  json["captured"] = counters.captured();
  json["received"] = counters.received;
  json["matched"] = counters.sum(Fate::matched);
  json["rejected"] = counters.sum(Fate::rejected);
  json["dropped"] = counters.sum(Fate::dropped);
  json["matched_by_status"] = by_reason(counters, Fate::matched);
  json["rejected_by_reason"] = by_reason(counters, Fate::rejected);
  json["dropped_by_reason"] = by_reason(counters, Fate::dropped);
  json["missed"] = counters.missed;
  json["duplicates"] = counters.duplicates;
  json["reordered"] = counters.reordered;
  json["sessions"] = counters.sessions;
  json["silent"] = counters.silent;
  json["ends_of_stream"] = counters.of(WireStatus::end_of_stream);
  json["unannounced"] = counters.unannounced;
  json["recorded"] = counters.recorded;
  json["unrecorded"] = counters.unrecorded;
  json["adds_up"] = counters.adds_up();
  return json.dump();
}

bool is_complete(const Counters& counters) {
  return counters.adds_up() && counters.sum(Fate::dropped) == 0 && counters.silent == 0 &&
         counters.unrecorded == 0;
}

}  // namespace lbea
