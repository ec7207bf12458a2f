#include "tools/replay/replay_settings.hpp"

#include "adapters/rig/sensor_json.hpp"
#include "adapters/wire/codec/codec.hpp"
#include "tools/replay/report.hpp"
#include "tools/shared/cli/printable.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/id_tracker.hpp"
#include "tools/shared/intake/test_answer.hpp"
#include "tools/shared/matching/match_engine.hpp"
#include "tools/shared/matching/views.hpp"

#include <spdlog/spdlog.h>

#include <barrier>
#include <cstdio>
#include <memory>
#include <thread>
#include <utility>

namespace lbea::tool {
namespace {

constexpr std::uint64_t most_differences_shown = 20;

/// Receives a result without times other than the frame's own and without counters. Returns whether to continue.
using ResultHandler = std::function<bool(const wire::WireResult& result, const TestKey& test)>;

/// A recorded frame. One that is not wanted only contributes to the test's history.
struct ReplayedFrame {
  const RecordedMessage& message;
  TestKey test;
  bool is_wanted = true;
};

/// With fit, a frame is matched with what the earlier ones of its test have shown, one after the other, unless
/// the run did not.
bool has_history(const RunSettings& settings) {
  return settings.matcher.method == Method::fit && settings.frames_alone == 0;
}

/// Matches recorded frames. The same recording and model give the same results to the last bit on any number of
/// threads.
class MatchReplay {
 public:
  /// `model` and `views` must remain.
  MatchReplay(const Model& model, const RunSettings& settings, const SensorViews& views, unsigned threads)
      : model_(model),
        config_(settings.matcher),
        views_(views),
        decoder_(wire::WireLimits{.max_points = config_.max_points}),
        engine_(model, with_max_points(1), views),
        slots_(threads),
        begin_(threads),
        end_(threads) {
    if (has_history(settings))
      history_.emplace(
          history_for(model, config_, views, {true, settings.estimates_pose != 0, settings.knows_impact != 0}));
    reserve(outcome_, config_.max_matches);
    workers_.reserve(slots_.size() - 1);
    try {
      for (std::size_t i = 1; i < slots_.size(); ++i) workers_.emplace_back([this, i] { work(slots_[i]); });
    } catch (...) {  // the destructor does not run after an exception
      for (std::size_t i = workers_.size() + 1; i < slots_.size(); ++i) begin_.arrive_and_drop();
      end_workers();
      throw;
    }
  }
  ~MatchReplay() { end_workers(); }
  MatchReplay(const MatchReplay&) = delete;
  MatchReplay& operator=(const MatchReplay&) = delete;

  /// Adds a recorded frame. Its result is delivered during this call or a later one, in the order of the frames.
  bool add(const ReplayedFrame& replayed, const ResultHandler& handle) {
    const RecordedMessage& frame = replayed.message;
    Slot& slot = slots_[filled_++];
    slot.test = replayed.test;
    slot.is_wanted = replayed.is_wanted;
    slot.status = decoder_.open(encoder_.frame_of_cloud(frame.data, frame.session, frame.id));
    slot.status = status_after(ids_.observe(frame.session, frame.id).arrival, slot.status);
    slot.header = decoder_.header();
    slot.header.frame_id = {};
    slot.header.cloud = {};
    slot.receive_ns = frame.log_time_ns;
    slot.points.resize(slot.status == wire::WireStatus::ok ? slot.header.points : 0);
    if (slot.status == wire::WireStatus::ok) {
      decoder_.read_points(slot.points);
      make_room(slot);
    }
    return filled_ < slots_.size() || flush(handle);
  }
  /// Registers the id of an earlier frame, so that later frames with this id are repetitions.
  void skip(const RecordedMessage& frame) { static_cast<void>(ids_.observe(frame.session, frame.id)); }
  /// Delivers the remaining results.
  bool flush(const ResultHandler& handle) {
    run_batch();
    bool go_on = true;
    for (std::size_t i = 0; i < filled_ && go_on; ++i) {
      const wire::WireResult result = result_of(slots_[i]);
      if (slots_[i].is_wanted) go_on = handle(result, slots_[i].test);
    }
    filled_ = 0;
    return go_on;
  }

 private:
  struct Slot {
    std::unique_ptr<Matcher> matcher;
    std::uint32_t max_points = 0;  // of the matcher
    wire::FrameHeader header;
    std::int64_t receive_ns = 0;
    wire::WireStatus status = wire::WireStatus::ok;
    std::vector<Point> points;
    MatchResult match;
    TestKey test;
    bool is_wanted = true;
  };
  [[nodiscard]] MatcherConfig with_max_points(std::uint32_t points) const {
    MatcherConfig config = config_;
    config.max_points = points;
    return config;
  }
  /// A recording may claim larger frames than it has, so a matcher gets memory for those that come.
  void make_room(Slot& slot) const {
    const auto points = static_cast<std::uint32_t>(slot.points.size());
    if (slot.matcher && points <= slot.max_points) return;
    slot.max_points = std::min(config_.max_points, points + points / 2 + 1);
    slot.matcher.reset();
    slot.matcher = std::make_unique<Matcher>(model_, with_max_points(slot.max_points), views_);
  }
  void match(Slot& slot) {
    if (slot.status != wire::WireStatus::ok) return;
    const Frame frame{slot.header.id, slot.header.stamp_ns, slot.points};
    slot.match = history_ ? slot.matcher->match(frame, *history_) : slot.matcher->match(frame);
  }

  void work(Slot& slot) {
    while (true) {
      begin_.arrive_and_wait();
      if (stopping_) return;
      match(slot);
      end_.arrive_and_wait();
    }
  }

  void end_workers() noexcept {
    stopping_ = true;
    if (!workers_.empty()) begin_.arrive_and_wait();
    for (std::thread& worker : workers_) worker.join();
  }

  void run_batch() {
    if (history_ && filled_ > 0) begin_test_of(slots_[0]);
    for (std::size_t i = filled_; i < slots_.size(); ++i)
      slots_[i].status = wire::WireStatus::end_of_stream;  // nothing to do
    if (!workers_.empty()) begin_.arrive_and_wait();
    match(slots_[0]);
    if (!workers_.empty()) end_.arrive_and_wait();
  }

  void begin_test_of(const Slot& slot) {
    if (slot.status != wire::WireStatus::ok) return;  // the matcher did not get it
    if (slot.test == std::exchange(test_, slot.test)) return;
    engine_.begin_test();
    if (history_) history_->reset();
  }

  wire::WireResult result_of(Slot& slot) {
    clear(outcome_);
    if (!history_) begin_test_of(slot);
    outcome_.result.status = slot.status;
    outcome_.result.points.received = slot.header.points;
    if (slot.status == wire::WireStatus::ok) {
      fill_outcome(outcome_, slot.match);
      fill_test(outcome_, engine_, slot.match);
    }
    wire::WireResult result;
    compose(outcome_, engine_, result);
    complete_verdict(result);
    result.session = slot.header.session;
    result.frame_id = slot.header.id;
    result.stamp_ns = slot.header.stamp_ns;
    result.receive_ns = slot.receive_ns;
    result.sequence = slot.is_wanted ? sequence_++ : 0;
    result.model_checksum = model_.checksum();
    result.elapsed_ns = {};
    return result;
  }

  const Model& model_;
  const MatcherConfig config_;
  const SensorViews& views_;
  wire::Encoder encoder_;
  wire::FrameDecoder decoder_;
  IdTracker ids_;
  ModelEngine engine_;  // sums up the test
  std::optional<TestHistory> history_;
  std::vector<Slot> slots_;  // one matcher per thread
  std::size_t filled_ = 0;
  std::optional<TestKey> test_;  // none before its first frame
  std::uint64_t sequence_ = 0;
  Outcome outcome_;
  bool stopping_ = false;
  std::barrier<> begin_, end_;
  std::vector<std::thread> workers_;
};

/// Prints, writes or compares each new result.
class ResultOutput {
 public:
  ResultOutput(const ModelReplayOptions& options, const RunSettings& settings, const Model& model,
               ResultComparison* comparison)
      : options_(options), model_(model), comparison_(comparison) {
    if (!options.output.empty()) file_ = std::make_unique<ResultsFile>(options.output, settings);
    if (comparison == nullptr && !options.json && options.output.empty()) std::printf("%s\n", result_header().c_str());
  }
  bool operator()(const wire::WireResult& result, const TestKey& test) {
    ++counters_.by_status[static_cast<std::size_t>(result.status)];
    if (test != std::exchange(test_, test)) print_answer();
    answer_.add(result);
    if (file_) file_->add(result);
    if (comparison_ != nullptr) {
      compare(result);
    } else if (options_.output.empty()) {
      std::printf("%s\n", (options_.json ? result_json(result) : printable(result_line(result))).c_str());
    }
    return stop_requested == 0;
  }
  /// Throws Error{bad_input} when no frame was matched and nothing is compared.
  void finish() {
    print_answer();
    if (file_) file_->finish();
    const std::string refusal = refusal_of_all(counters_, model_.length_unit());
    if (!refusal.empty() && comparison_ == nullptr)
      throw Error(Status::bad_input, options_.settings.recording + ": " + refusal);
  }

 private:
  /// Of the test that ends.
  void print_answer() {
    std::vector<std::string> names;
    for (std::uint32_t i = 0; i < model_.simulations(); ++i) names.emplace_back(model_.simulation_name(i));
    if (answer_.state().frames > 0 && comparison_ == nullptr && !options_.json)
      std::printf("test: %s\n", printable(answer_text(answer_.state(), names)).c_str());
    if (const std::string warning = answer_.warning(); !warning.empty()) spdlog::warn(warning);
    answer_ = {};
  }
  void compare(const wire::WireResult& result) {
    const auto difference = comparison_->compare(result);
    if (difference && shown_++ < most_differences_shown && !options_.json)
      std::printf("%s\n", printable(*difference).c_str());
  }
  const ModelReplayOptions& options_;
  const Model& model_;
  ResultComparison* comparison_;
  wire::Counters counters_;
  TestAnswer answer_;
  TestKey test_;
  std::unique_ptr<ResultsFile> file_;
  std::uint64_t shown_ = 0;
};

/// Matches the frames of the part and, before them, those of the same test, on which its first results depend. Frames
/// that the matcher dropped would change the results of the others. False when stopped.
bool match_part(RecordedRun& run, const Part& part, std::int64_t history_ns, const FrameFates& fates,
                MatchReplay& replay, const ResultHandler& handle, std::uint64_t& dropped) {
  run.limit(Part{}.from_ns, part.to_ns);
  run.rewind();
  while (const auto message = run.next()) {
    if (stop_requested != 0) return false;
    if (message->kind != RecordedMessage::Kind::frame) continue;
    const FrameKey frame{message->session, message->id};
    const bool is_wanted = message->log_time_ns >= part.from_ns;
    if (fates.was_dropped(frame)) {
      if (is_wanted) ++dropped;
    } else if (message->log_time_ns < history_ns) {
      replay.skip(*message);
    } else if (!replay.add({*message, fates.test_of(frame), is_wanted}, handle)) {
      return false;
    }
  }
  return replay.flush(handle);
}

void warn_of_gaps(const ComparisonTally& tally, const std::string& file) {
  if (tally.edge_frames + tally.edge_results > 0)
    spdlog::warn(
        "{} starts or ends between frames and their results: {} frames without a result and {} results without a frame "
        "are not compared",
        file, tally.edge_frames, tally.edge_results);
  if (tally.without_history > 0)
    spdlog::warn("{}: the test began before the recording; {} results depend on earlier frames and are not compared",
                 file, tally.without_history);
}

[[noreturn]] void report_nothing_compared(const ComparisonTally& tally, const std::string& file) {
  throw Error(Status::bad_input,
              file + ": nothing was compared, because " +
                  (tally.without_history > 0
                       ? "its results depend on frames before the recording; start recording before the test"
                       : "no frame is recorded with its result; see lbea-inspect"));
}

bool conclude(ComparisonTally tally, const Part& part, const ModelReplayOptions& options) {
  const std::string& file = options.settings.recording;
  if (!part.is_whole) tally.not_repeated = tally.edge_results = 0;  // from other frames
  warn_of_gaps(tally, file);
  std::printf("%s\n", (options.json ? comparison_json(tally) : comparison_line(tally)).c_str());
  if (tally.compared() == 0) report_nothing_compared(tally, file);
  return tally.is_same();
}

}  // namespace

bool replay_into_model(RecordedRun& run, const Part& part, const ModelReplayOptions& options) {
  const Model model = Model::open(options.settings.model_file);
  const RunSettings settings = replay_settings(run.settings(), model, options.settings);
  const FrameFates fates(run);
  std::optional<ResultComparison> comparison;
  if (options.compares) comparison.emplace(run, fates, options.tolerance, has_history(settings));
  ResultComparison* const compared = comparison ? &*comparison : nullptr;
  ResultOutput output(options, settings, model, compared);
  const std::string& pose_file = options.settings.pose_file;
  if (!pose_file.empty()) (void)io::read_pose(pose_file, model.length_unit());
  const SensorViews views = views_for(settings.matcher, model, settings.sensor_json,
                                      pose_file.empty() ? options.settings.recording + " (sensor.json)" : pose_file);
  MatchReplay replay(model, settings, views, has_history(settings) ? 1 : options.threads);
  const ResultHandler handle = [&](const wire::WireResult& result, const TestKey& test) {
    return output(result, test);
  };
  const std::int64_t history_ns = has_history(settings) ? history_of(run, part, fates) : part.from_ns;
  std::uint64_t dropped = 0;
  if (!match_part(run, part, history_ns, fates, replay, handle, dropped)) return false;
  if (dropped > 0) spdlog::info("{} recorded frames did not get into the matcher and are not matched", dropped);
  output.finish();
  return !comparison || conclude(comparison->tally(), part, options);
}

}  // namespace lbea::tool
