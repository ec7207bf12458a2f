#include "tools/monitor/feeds/recording_feed.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "tools/monitor/feeds/health.hpp"
#include "tools/monitor/scene/shown_components.hpp"
#include "tools/shared/answer/component_results.hpp"
#include "tools/shared/matching/preview.hpp"
#include "tools/shared/recording/recorded_run.hpp"
#include "tools/shared/recording/run_audit.hpp"
#include "tools/shared/text/formatted.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <iterator>
#include <mutex>

namespace lbea::tool {
namespace {

constexpr std::uint32_t most_points_read = std::uint32_t{1} << 24;
constexpr std::size_t most_tests = 256;
constexpr std::size_t rows_per_batch = 2048;

template <class Number>
Number number_in(std::string_view target, std::string_view key, Number otherwise) {
  return parsed<Number>(http::query_value(target, key)).value_or(otherwise);
}

/// "SESSION", and "SESSION.2" for its second test.
std::string text(const TestKey& test) {
  return std::to_string(test.first) + (test.second == 0 ? "" : "." + std::to_string(test.second + 1));
}

std::optional<TestKey> test_in(std::string_view target) {
  const std::string_view view = http::query_value(target, "session");
  const auto dot = view.find('.');
  const auto session = parsed<std::uint64_t>(view.substr(0, dot));
  const auto number = dot == view.npos ? std::optional<std::uint64_t>(1) : parsed<std::uint64_t>(view.substr(dot + 1));
  return session && number && *number > 0 ? std::optional<TestKey>({*session, *number - 1}) : std::nullopt;
}

std::string summary_of(const RunAudit& audit) { return audit.is_complete() ? "complete" : audit.flaws().front(); }

class Recording final : public RecordingFeed {
 public:
  Recording(const std::filesystem::path& file, const std::vector<NamedModel>& models)
      : name_(file.filename().string()), audit_(summary_of(audit_run(file))), components_(models), run_(file) {
    read_all();
  }

  /// A recording does not change, so there are no further rows.
  [[nodiscard]] std::string rows_after(LogCursors&) override { return {}; }
  /// "/api/recording/rows?session=S&first=N", "/api/recording/frame?number=N", and the exports of the models. With
  /// several components, "component=" names that of rows and exports.
  [[nodiscard]] std::optional<http::Response> respond(std::string_view target) override {
    const std::lock_guard lock(mutex_);
    const std::string_view path = target.substr(0, target.find('?'));
    if (path == "/api/model")
      return binary_response(
          components_.description({{"file", name_}, {"frames", entries_.size()}, {"words", audit_}}));
    const auto component = components_.component_in(target);
    if (path == "/api/recording/rows" && component) return binary_response(rows_packet(target, *component));
    if (path == "/export/curves.csv" && component)
      return curves_response(log_of(test_in(target).value_or(first_test()), *component),
                             components_.simulation_names(*component), components_.file_prefix(*component));
    if (path != "/api/recording/frame") return components_.respond(target);
    const auto number = number_in<std::size_t>(target, "number", entries_.size());
    if (number >= entries_.size()) return text_response(404, "number= needs a frame of the recording, counted from 0");
    return binary_response(frame_packet(entries_[number]));
  }

  [[nodiscard]] std::size_t frames() const noexcept override { return entries_.size(); }

 private:
  using FrameKey = std::pair<std::uint64_t, std::uint64_t>;  // session and id
  struct EntryCloud {
    std::int64_t frame_ns = 0;  // log time
    FrameKey frame;
    RigidTransform T_reference_sensor = identity_transform;
  };
  struct Entry {
    std::vector<EntryCloud> clouds;                      // one of each rig; none that the recording lacks
    std::vector<std::optional<std::int64_t>> result_ns;  // log times, of each component
    std::uint64_t session = 0, id = 0;
    TestKey test;
  };
  using FrameTimes = std::map<FrameKey, std::int64_t>;
  void read_all() {
    FrameTimes frames;
    while (const auto message = run_.next()) {
      if (message->kind == RecordedMessage::Kind::frame)
        frames.try_emplace({message->session, message->id}, message->log_time_ns);
    }
    run_.rewind();
    while (const auto message = run_.next())
      if (message->kind == RecordedMessage::Kind::result) add_result(*message, frames);
  }
  void add_result(const RecordedMessage& message, const FrameTimes& frames) {
    wire::WireResult result;
    if (wire::decode_result(message.data, result) != wire::WireStatus::ok) return health_.add_unreadable();
    const std::vector<std::size_t> concerned = components_.concerned(result);
    if (concerned.empty()) return health_.add_other(result);
    if (concerned.front() == 0)
      health_.add(result, time_);
    else
      health_.add_other(result);
    const TestKey test = test_of(result);
    for (const std::size_t i : concerned) add_to_log(test, i, result);
    if (wire::fate_of(result.status) == wire::Fate::not_a_capture) return;
    Entry& entry = entry_of(result, concerned.front());
    if (entry.clouds.empty()) entry.clouds = clouds_of(result, frames);
    entry.test = test;
    for (const std::size_t i : concerned) entry.result_ns[i] = message.log_time_ns;
  }
  void add_to_log(const TestKey& test, std::size_t component, const wire::WireResult& result) {
    if (logs_.size() >= most_tests && !logs_.contains(test)) return;
    std::vector<TestLog>& logs = logs_[test];
    logs.resize(components_.size());
    logs[component].add(result);
  }
  /// That of the frame's other components, which come one after the other, or a new one.
  [[nodiscard]] Entry& entry_of(const wire::WireResult& result, std::size_t component) {
    const bool is_of_frame = result.component.empty();
    if (!is_of_frame && of_components_ && entries_[*of_components_].session == result.session &&
        entries_[*of_components_].id == result.frame_id && !entries_[*of_components_].result_ns[component])
      return entries_[*of_components_];
    if (!is_of_frame) of_components_ = entries_.size();
    Entry& entry = entries_.emplace_back();
    entry.session = result.session;
    entry.id = result.frame_id;
    entry.result_ns.resize(components_.size());
    return entry;
  }
  [[nodiscard]] std::vector<EntryCloud> clouds_of(const wire::WireResult& result, const FrameTimes& frames) const {
    std::vector<EntryCloud> clouds;
    const auto add = [&](const FrameKey& key, const RigidTransform& T_reference_sensor) {
      if (const auto frame = frames.find(key); frame != frames.end())
        clouds.push_back({frame->second, key, T_reference_sensor});
    };
    const RunSettings& settings = run_.settings();
    if (result.rigs.empty()) add({result.session, result.frame_id}, settings.matcher.T_reference_sensor);
    for (const wire::WireRigFrame& frame : result.rigs) {
      const auto rig = std::ranges::find(settings.rigs, frame.rig, &RigSettings::name);
      if (rig != settings.rigs.end() && frame.is_used) add({frame.session, frame.frame_id}, rig->T_reference_sensor);
    }
    return clouds;
  }
  /// The first matched frame after the end of its stream begins another test.
  TestKey test_of(const wire::WireResult& result) {
    std::uint64_t& number = numbers_[result.session];
    const auto logs = logs_.find({result.session, number});
    if (wire::fate_of(result.status) == wire::Fate::matched && logs != logs_.end() &&
        std::ranges::any_of(logs->second, &TestLog::is_complete))
      ++number;
    return {result.session, number};
  }
  [[nodiscard]] TestKey first_test() const { return entries_.empty() ? TestKey() : entries_.front().test; }

  [[nodiscard]] std::string frame_packet(const Entry& entry) {
    AssembledMoment moment{{}, cloud_of(entry)};
    std::vector<nlohmann::json> heads;
    for (std::size_t i = 0; i < components_.size(); ++i) {
      moment.results.push_back(result_of(entry, i));
      heads.push_back(head_of(entry, i, moment.results.back()));
    }
    Health health = health_;
    health.add(moment.results.front(), time_);
    nlohmann::json head{{"health", health.report(time_)}, {"has_preview", true}};
    head["health"]["recording"] = audit_;
    return components_.build(moment, std::move(head), std::move(heads));
  }
  [[nodiscard]] nlohmann::json head_of(const Entry& entry, std::size_t component,
                                       const wire::WireResult& result) const {
    const TestLog& log = log_of(entry.test, component);
    nlohmann::json head{{"type", "snapshot"},
                        {"result", to_json(result)},
                        {"model_differs", result.model_checksum != 0 &&
                                              result.model_checksum != components_.model(component).checksum()},
                        {"test", to_json(log, result.stamp_ns, components_.simulation_names(component))}};
    head["test"]["session"] = text(entry.test);
    return head;
  }

  [[nodiscard]] std::string rows_packet(std::string_view target, std::size_t component) const {
    const TestLog& log = log_of(test_in(target).value_or(TestKey()), component);
    LogCursor cursor{log.epoch(), std::min(number_in<std::size_t>(target, "first", 0), log.rows().size())};
    if (cursor.row == 0) cursor.epoch = 0;  // gives a packet even when there are no rows
    return next_rows(log, cursor, rows_per_batch);
  }
  [[nodiscard]] wire::WireResult result_of(const Entry& entry, std::size_t component) {
    if (!entry.result_ns[component]) return {};
    wire::WireResult result;
    run_.rewind();
    run_.limit(*entry.result_ns[component], *entry.result_ns[component]);
    while (const auto message = run_.next())
      if (message->kind == RecordedMessage::Kind::result &&
          wire::decode_result(message->data, result) == wire::WireStatus::ok && result.session == entry.session &&
          result.frame_id == entry.id && concerns(result, components_.model(component).checksum()))
        return result;
    return {};
  }

  [[nodiscard]] std::shared_ptr<const std::vector<Point>> cloud_of(const Entry& entry) {
    std::vector<Point> all;
    for (const EntryCloud& cloud : entry.clouds) std::ranges::copy(points_of(cloud), std::back_inserter(all));
    return all.empty() ? nullptr : std::make_shared<const std::vector<Point>>(std::move(all));
  }
  [[nodiscard]] std::vector<Point> points_of(const EntryCloud& cloud) {
    const auto [session, id] = cloud.frame;
    run_.rewind();
    run_.limit(cloud.frame_ns, cloud.frame_ns);
    while (const auto message = run_.next()) {
      if (message->kind != RecordedMessage::Kind::frame || message->session != session || message->id != id) continue;
      wire::Encoder encoder;
      wire::DecodedFrame frame;
      if (wire::decode_frame(encoder.frame_of_cloud(message->data, session, id), frame,
                             {.max_points = most_points_read}) != wire::WireStatus::ok)
        return {};
      thin(frame.points, PreviewConfig{}.max_points, cloud.T_reference_sensor);
      return std::move(frame.points);
    }
    return {};
  }

  [[nodiscard]] const TestLog& log_of(const TestKey& test, std::size_t component) const {
    static const TestLog none;
    const auto logs = logs_.find(test);
    return logs == logs_.end() ? none : logs->second[component];
  }

  std::string name_, audit_;
  ShownComponents components_;
  std::mutex mutex_;  // of the members below
  RecordedRun run_;
  Health health_;
  // One time for all results, so that the latencies are those of the whole recording.
  Health::Clock::time_point time_ = Health::Clock::now();
  std::vector<Entry> entries_;
  std::optional<std::size_t> of_components_;        // place of the latest entry that has results of single components
  std::map<std::uint64_t, std::uint64_t> numbers_;  // of the latest test of each session
  std::map<TestKey, std::vector<TestLog>> logs_;    // of each component
};

}  // namespace

std::unique_ptr<RecordingFeed> make_recording_feed(const std::filesystem::path& file,
                                                   const std::vector<NamedModel>& models) {
  return std::make_unique<Recording>(file, models);
}

}  // namespace lbea::tool
