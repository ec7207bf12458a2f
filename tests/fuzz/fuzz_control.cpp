// Arbitrary bytes as a control message: refused, or decoded and equal after encoding again. Then the counters of
// IdTracker must add up for any sequence of messages of several senders.
#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/intake/id_tracker.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

void check_account(std::span<const std::byte> words) {
  lbea::tool::IdTracker ids;
  struct Word {
    std::uint8_t kind, session, held, pad;
    std::uint32_t id;
  } word{};
  for (; words.size() >= sizeof word; words = words.subspan(sizeof word)) {
    std::memcpy(&word, words.data(), sizeof word);
    const std::uint64_t id = word.kind & 0x80 ? std::uint64_t{word.id} << 32 | word.id : word.id % 64;
    if (word.kind % 4 == 3) {
      ids.observe(word.session % 3, id);
      if (word.kind & 0x40) static_cast<void>(ids.enter_test(word.session % 3));
    } else {
      const auto kind = static_cast<lbea::wire::ControlKind>(word.kind % 4);
      static_cast<void>(ids.report({word.session % 3u, kind, id, std::min<std::uint64_t>(word.held, id)}));
    }
    for (const lbea::wire::WireSender& sender : ids.senders({}, {}))
      require(sender.next_id - sender.first_id == sender.received + sender.missed + sender.withheld);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto message = std::as_bytes(std::span{data, size});
  if (lbea::wire::Control control, again; lbea::wire::decode_control(message, control) == lbea::wire::WireStatus::ok) {
    lbea::wire::Encoder encoder;
    require(lbea::wire::decode_control(encoder.control(control), again) == lbea::wire::WireStatus::ok &&
            again == control);
    require(control.withheld <= control.next_id);
  }
  check_account(message.first(std::min<std::size_t>(message.size(), 4096)));
  return 0;
}
