#include "tools/shared/recording/recording_format.hpp"

#include <charconv>
#include <sstream>

namespace lbea::tool {
namespace {

/// The shortest text that reads back as the same number.
template <class Number>
std::string text(Number number) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  return {digits.data(), end};
}

std::string text(const RigidTransform& transform) {
  std::string line;
  for (const float value : transform) line += (line.empty() ? "" : " ") + text(value);
  return line;
}

/// Reads values by key; an absent key leaves the value unchanged.
class SettingsReader {
 public:
  SettingsReader(const mcap::Texts& texts, std::string file) : texts_(texts), file_(std::move(file)) {}
  void read(const char* key, std::string& into) const {
    if (const auto found = texts_.find(key); found != texts_.end()) into = found->second;
  }
  template <class Number>
  void read(const char* key, Number& into) const {
    const auto found = texts_.find(key);
    if (found == texts_.end()) return;
    const char* from = found->second.data();
    const char* const end = from + found->second.size();
    if (!parse(from, end, into) || from != end) fail(key);
  }
  void read(const char* key, RigidTransform& into) const {
    const auto found = texts_.find(key);
    if (found == texts_.end()) return;
    const char* from = found->second.data();
    const char* const end = from + found->second.size();
    for (float& value : into) {
      if (from != end && *from == ' ') ++from;
      if (!parse(from, end, value)) fail(key);
    }
    if (from != end) fail(key);
  }

 private:
  template <class Number>
  static bool parse(const char*& from, const char* end, Number& into) {
    const auto [next, error] = std::from_chars(from, end, into);
    from = next;
    return error == std::errc();
  }
  [[noreturn]] void fail(const std::string& key) const {
    throw Error(Status::bad_input, file_ + ": its metadata \"" + std::string(settings_metadata_name) +
                                       "\" has no valid number in \"" + key +
                                       "\"; set it on the command line of a matcher instead of replaying into a model");
  }
  const mcap::Texts& texts_;
  std::string file_;
};

constexpr std::array<std::string_view, 3> condition_names{"active", "ended", "silent"};

bool read(std::istream& in, wire::SenderCondition& condition) {
  std::string name;
  in >> name;
  for (std::size_t i = 0; i < condition_names.size(); ++i) {
    if (name != condition_names[i]) continue;
    condition = static_cast<wire::SenderCondition>(i);
    return true;
  }
  return false;
}

}  // namespace

std::uint32_t checked_max_points(std::uint32_t points, const std::string& file) {
  if (points > 0 && points <= wire::WireLimits::most_points) return points;
  throw Error(Status::bad_input, file + ": max_points is " + std::to_string(points) + ", outside 1 to " +
                                     std::to_string(wire::WireLimits::most_points) +
                                     "; lbea does not record this: check where the file comes from");
}

mcap::Metadata to_metadata(const RunSettings& settings) {
  const MatcherConfig& matcher = settings.matcher;
  return {std::string(settings_metadata_name),
          {{"program", settings.program},
           {"model_file", settings.model_file},
           {"model_checksum", text(settings.model_checksum)},
           {"method", settings.method},
           {"method_number", text(static_cast<std::int32_t>(matcher.method))},
           {"max_points", text(matcher.max_points)},
           {"max_matches", text(matcher.max_matches)},
           {"trusted_distance", text(matcher.trusted_distance)},
           {"min_coverage", text(matcher.min_coverage)},
           {"trigger_ns", text(matcher.trigger_ns)},
           {"T_reference_sensor", text(matcher.T_reference_sensor)},
           {"sensor_json", settings.sensor_json},
           {"start_ns", text(settings.start_ns)},
           {"record_window", settings.record_window}}};
}

RunSettings settings_from(const mcap::Metadata& metadata, const std::string& file) {
  const SettingsReader from(metadata.texts, file);
  RunSettings settings;
  MatcherConfig& matcher = settings.matcher;
  from.read("program", settings.program);
  from.read("model_file", settings.model_file);
  from.read("model_checksum", settings.model_checksum);
  from.read("method", settings.method);
  auto method = static_cast<std::int32_t>(matcher.method);
  from.read("method_number", method);
  matcher.method = static_cast<Method>(method);
  from.read("max_points", matcher.max_points);
  matcher.max_points = checked_max_points(matcher.max_points, file);
  from.read("max_matches", matcher.max_matches);
  from.read("trusted_distance", matcher.trusted_distance);
  from.read("min_coverage", matcher.min_coverage);
  from.read("trigger_ns", matcher.trigger_ns);
  from.read("T_reference_sensor", matcher.T_reference_sensor);
  from.read("sensor_json", settings.sensor_json);
  from.read("start_ns", settings.start_ns);
  from.read("record_window", settings.record_window);
  return settings;
}

mcap::Metadata to_metadata(const std::vector<wire::WireSender>& senders, std::uint64_t interleaved) {
  mcap::Metadata metadata{std::string(senders_metadata_name),
                          {{std::string(interleaved_key), std::to_string(interleaved)}}};
  for (const wire::WireSender& sender : senders) {
    std::ostringstream key, text;
    key << std::hex << sender.session;
    text << sender.first_id << ' ' << sender.next_id << ' ' << sender.received << ' ' << sender.missed << ' '
         << sender.withheld << ' ' << condition_names[static_cast<std::size_t>(sender.condition)];
    metadata.texts[key.str()] = text.str();
  }
  return metadata;
}

std::vector<wire::WireSender> senders_from(const mcap::Metadata& metadata) {
  std::vector<wire::WireSender> senders;
  for (const auto& [session, account] : metadata.texts) {
    wire::WireSender sender;
    std::istringstream key(session), text(account);
    const bool is_read =
        key >> std::hex >> sender.session &&
        text >> sender.first_id >> sender.next_id >> sender.received >> sender.missed >> sender.withheld &&
        read(text, sender.condition);
    if (is_read && sender.first_id <= sender.next_id) senders.push_back(sender);
  }
  return senders;
}

}  // namespace lbea::tool
