// Arbitrary bytes as a result, a state or an inference: refused, or decoded and equal after encoding again.
#include "adapters/wire/codec/codec.hpp"

#include <cstdlib>

namespace {
void require(bool holds) {
  if (!holds) std::abort();
}
}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto message = std::as_bytes(std::span{data, size});
  lbea::wire::Encoder encoder;
  if (lbea::wire::WireResult result, again; lbea::wire::decode_result(message, result) == lbea::wire::WireStatus::ok) {
    require(lbea::wire::decode_result(encoder.result(result), again) == lbea::wire::WireStatus::ok);
    require(again.counters == result.counters && again.matches.size() == result.matches.size());
    static_cast<void>(lbea::wire::to_string(result.status));
    static_cast<void>(lbea::wire::explain(result.status));
  }
  if (lbea::wire::WireState state, again; lbea::wire::decode_state(message, state) == lbea::wire::WireStatus::ok) {
    require(lbea::wire::decode_state(encoder.state(state), again) == lbea::wire::WireStatus::ok);
    require(again.model.simulations == state.model.simulations && again.version == state.version);
  }
  if (lbea::wire::WireInference inference, again;
      lbea::wire::decode_inference(message, inference) == lbea::wire::WireStatus::ok) {
    require(lbea::wire::decode_inference(encoder.inference(inference), again) == lbea::wire::WireStatus::ok);
    require(again.values.size() == inference.values.size() && again.field == inference.field &&
            again.component == inference.component);
  }
  return 0;
}
