// Any bytes as a recording: the check stays within their bounds, and the recovered file is sound.
#include "adapters/mcap/salvage.hpp"

#include <lbea/lbea.hpp>

#include <cstdlib>

namespace {

class BufferSink final : public lbea::mcap::Sink {
 public:
  int append(std::span<const lbea::mcap::Bytes> pieces) noexcept override {
    for (const auto piece : pieces) bytes.insert(bytes.end(), piece.begin(), piece.end());
    return 0;
  }
  int sync() noexcept override { return 0; }
  int commit() noexcept override { return 0; }
  lbea::mcap::Buffer bytes;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lbea::mcap;
  const MemorySource source(std::as_bytes(std::span{data, size}));
  std::uint64_t seen = 0;
  const FileCheck found = check_file(source, [&](const Message& message, const Channel*) {
    for (const std::byte byte : message.data) seen += static_cast<std::uint64_t>(byte);
  });
  BufferSink sink;
  Recovery recovery;
  try {
    recovery = recover(source, sink);
  } catch (const lbea::Error&) { return 0; }
  const FileCheck again = check_file(MemorySource(sink.bytes));
  if (!again.is_closed || !again.gaps.empty() || again.counted.messages != recovery.messages) std::abort();
  if (recovery.messages + recovery.undefined_messages != found.counted.messages) std::abort();
  return seen == std::uint64_t(-1) ? 1 : 0;
}
