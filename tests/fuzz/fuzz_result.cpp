// Any bytes as a result, a state or an inference: refused, or read and, once written again, read as the same.
#include "adapters/wire/codec/codec.hpp"

#include <cstdlib>

namespace {
void require(bool holds) {
  if (!holds) std::abort();
}
}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto message = std::as_bytes(std::span{data, size});
  lbea::Encoder encoder;
  if (lbea::WireResult result, again; lbea::decode_result(message, result) == lbea::WireStatus::ok) {
    require(lbea::decode_result(encoder.result(result), again) == lbea::WireStatus::ok);
    require(again.counters == result.counters && again.matches.size() == result.matches.size());
    static_cast<void>(lbea::to_string(result.status));
    static_cast<void>(lbea::explain(result.status));
  }
  if (lbea::WireState state, again; lbea::decode_state(message, state) == lbea::WireStatus::ok) {
    require(lbea::decode_state(encoder.state(state), again) == lbea::WireStatus::ok);
    require(again.model.simulations == state.model.simulations && again.version == state.version);
  }
  if (lbea::WireInference inference, again; lbea::decode_inference(message, inference) == lbea::WireStatus::ok) {
    require(lbea::decode_inference(encoder.inference(inference), again) == lbea::WireStatus::ok);
    require(again.values.size() == inference.values.size() && again.field == inference.field);
  }
  return 0;
}
