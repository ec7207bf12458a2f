#include "tools/serve/tally.hpp"

#include <nlohmann/json.hpp>

namespace lbea::tool {
namespace {

template <class Visit>
void for_each_status(wire::Fate fate, Visit visit) {
  for (std::size_t i = 0; i < wire::wire_status_count; ++i) {
    if (const auto status = static_cast<wire::WireStatus>(i); wire::fate_of(status) == fate) visit(status);
  }
}

std::string reasons(const wire::Counters& counters, wire::Fate fate) {
  std::string text;
  for_each_status(fate, [&](wire::WireStatus status) {
    if (counters.of(status) == 0) return;
    text +=
        (text.empty() ? " (" : ", ") + std::string(wire::to_string(status)) + " " + std::to_string(counters.of(status));
  });
  return std::to_string(counters.sum(fate)) + text + (text.empty() ? "" : ")");
}

std::string silence(const wire::Counters& counters) {
  if (counters.silent == 0) return {};
  return " (" + std::to_string(counters.silent) + " gone without goodbye: what they held back is unknown)";
}

std::string recording_text(const wire::Counters& counters) {
  if (counters.recorded == 0 && counters.unrecorded == 0) return {};
  return "; recorded " + std::to_string(counters.recorded) + ", NOT recorded " + std::to_string(counters.unrecorded);
}

nlohmann::ordered_json by_reason(const wire::Counters& counters, wire::Fate fate) {
  nlohmann::ordered_json json = nlohmann::ordered_json::object();
  for_each_status(fate,
                  [&](wire::WireStatus status) { json[std::string(wire::to_string(status))] = counters.of(status); });
  return json;
}

}  // namespace

std::string tally_line(const wire::Counters& counters) {
  return "captured " + std::to_string(counters.captured()) + (counters.adds_up() ? " = " : " IS NOT ") + "matched " +
         reasons(counters, wire::Fate::matched) + " + rejected " + reasons(counters, wire::Fate::rejected) +
         " + dropped " + reasons(counters, wire::Fate::dropped) + "; received " + std::to_string(counters.received) +
         ", reordered " + std::to_string(counters.reordered) + ", sessions " + std::to_string(counters.sessions) +
         silence(counters) + recording_text(counters);
}

std::string tally_json(const wire::Counters& counters) {
  nlohmann::ordered_json json =
      nlohmann::ordered_json::object();  // the library's null that becomes one cannot be destroyed when memory is out
  json["captured"] = counters.captured();
  json["received"] = counters.received;
  json["matched"] = counters.sum(wire::Fate::matched);
  json["rejected"] = counters.sum(wire::Fate::rejected);
  json["dropped"] = counters.sum(wire::Fate::dropped);
  json["matched_by_status"] = by_reason(counters, wire::Fate::matched);
  json["rejected_by_reason"] = by_reason(counters, wire::Fate::rejected);
  json["dropped_by_reason"] = by_reason(counters, wire::Fate::dropped);
  json["missed"] = counters.missed;
  json["duplicates"] = counters.duplicates;
  json["reordered"] = counters.reordered;
  json["sessions"] = counters.sessions;
  json["silent"] = counters.silent;
  json["ends_of_stream"] = counters.of(wire::WireStatus::end_of_stream);
  json["unannounced"] = counters.unannounced;
  json["recorded"] = counters.recorded;
  json["unrecorded"] = counters.unrecorded;
  json["adds_up"] = counters.adds_up();
  return json.dump();
}

bool is_complete(const wire::Counters& counters) {
  return counters.adds_up() && counters.sum(wire::Fate::dropped) == 0 && counters.silent == 0 &&
         counters.unrecorded == 0;
}

}  // namespace lbea::tool
