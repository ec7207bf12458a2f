// Several observers where the pipeline knows one.
#pragma once

#include "tools/shared/intake/run_observer.hpp"

#include <vector>

namespace lbea::tool {

class RunObservers final : public RunObserver {
 public:
  /// Before the pipeline starts; null is left out.
  void add(RunObserver* observer) {
    if (observer != nullptr) observers_.push_back(observer);
  }
  void frame(wire::Message message, const wire::FrameHeader& header, std::int64_t receive_ns) noexcept override {
    for (RunObserver* observer : observers_) observer->frame(message, header, receive_ns);
  }
  void result(wire::Message message, const wire::WireResult& result) noexcept override {
    for (RunObserver* observer : observers_) observer->result(message, result);
  }
  void state(wire::Message message, const wire::WireState& state) noexcept override {
    for (RunObserver* observer : observers_) observer->state(message, state);
  }
  [[nodiscard]] Counts counts() const noexcept override {
    Counts sum;
    for (const RunObserver* observer : observers_) {
      sum.recorded += observer->counts().recorded;
      sum.unrecorded += observer->counts().unrecorded;
    }
    return sum;
  }
  [[nodiscard]] std::optional<wire::WireRecording> recording() const noexcept override {
    for (const RunObserver* observer : observers_)
      if (auto found = observer->recording()) return found;
    return {};
  }

 private:
  std::vector<RunObserver*> observers_;
};

}  // namespace lbea::tool
