#include "tools/replay/match_replay.hpp"

namespace lbea::tool {

MatchReplay::MatchReplay(const Model& model, const MatcherConfig& config, const SensorViews& views, unsigned threads)
    : model_checksum_(model.checksum()),
      decoder_(wire::WireLimits{.max_points = config.max_points}),
      slots_(threads),
      begin_(threads),
      end_(threads) {
  reserve(outcome_, config.max_matches);
  for (Slot& slot : slots_) slot.engine = std::make_unique<ModelEngine>(model, config, views);
  workers_.reserve(slots_.size() - 1);
  try {
    for (std::size_t i = 1; i < slots_.size(); ++i) workers_.emplace_back([this, i] { work(slots_[i]); });
  } catch (...) {  // the destructor does not run after an exception
    for (std::size_t i = workers_.size() + 1; i < slots_.size(); ++i) begin_.arrive_and_drop();
    end_workers();
    throw;
  }
}

MatchReplay::~MatchReplay() { end_workers(); }

void MatchReplay::end_workers() noexcept {
  stopping_ = true;
  if (!workers_.empty()) begin_.arrive_and_wait();
  for (std::thread& worker : workers_) worker.join();
}

bool MatchReplay::add(const RecordedMessage& frame, bool is_wanted, const ResultHandler& handle) {
  Slot& slot = slots_[filled_++];
  slot.is_wanted = is_wanted;
  slot.status = decoder_.open(encoder_.frame_of_cloud(frame.data, frame.session, frame.id));
  slot.status = status_after(ids_.observe(frame.session, frame.id).arrival, slot.status);
  slot.header = decoder_.header();
  slot.header.frame_id = {};
  slot.header.cloud = {};
  slot.receive_ns = frame.log_time_ns;
  slot.points.resize(slot.status == wire::WireStatus::ok ? slot.header.points : 0);
  if (slot.status == wire::WireStatus::ok) decoder_.read_points(slot.points);
  return filled_ < slots_.size() || flush(handle);
}

bool MatchReplay::flush(const ResultHandler& handle) {
  run_batch();
  bool go_on = true;
  for (std::size_t i = 0; i < filled_ && go_on; ++i) {
    const wire::WireResult result = result_of(slots_[i]);
    if (slots_[i].is_wanted) go_on = handle(result);
  }
  filled_ = 0;
  return go_on;
}

namespace {
void match(auto& slot) {
  if (slot.status == wire::WireStatus::ok)
    slot.match = slot.engine->match({slot.header.id, slot.header.stamp_ns, slot.points});
}
}  // namespace

void MatchReplay::run_batch() {
  for (std::size_t i = filled_; i < slots_.size(); ++i)
    slots_[i].status = wire::WireStatus::end_of_stream;  // nothing to do
  if (!workers_.empty()) begin_.arrive_and_wait();
  match(slots_[0]);
  if (!workers_.empty()) end_.arrive_and_wait();
}

void MatchReplay::work(Slot& slot) {
  while (true) {
    begin_.arrive_and_wait();
    if (stopping_) return;
    match(slot);
    end_.arrive_and_wait();
  }
}

wire::WireResult MatchReplay::result_of(Slot& slot) {
  ModelEngine& first = *slots_[0].engine;
  clear(outcome_);
  if (slot.header.session != std::exchange(session_, slot.header.session)) first.begin_test();
  outcome_.result.status = slot.status;
  outcome_.result.points.received = slot.header.points;
  if (slot.status == wire::WireStatus::ok) fill_outcome(outcome_, slot.match, first.track(slot.match));
  wire::WireResult result;
  compose(outcome_, first, result);
  complete_verdict(result);
  result.session = slot.header.session;
  result.frame_id = slot.header.id;
  result.stamp_ns = slot.header.stamp_ns;
  result.receive_ns = slot.receive_ns;
  result.sequence = slot.is_wanted ? sequence_++ : 0;
  result.model_checksum = model_checksum_;
  result.elapsed_ns = {};
  return result;
}

}  // namespace lbea::tool
