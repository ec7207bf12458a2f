// What the matcher that frames are replayed to says of them.
#pragma once

#include "tools/shared/intake/handshake.hpp"

#include <functional>
#include <optional>

namespace lbea::tool {

class MatcherWitness {
 public:
  /// Waits for the first word of the matcher whose results are there. Throws Error{bad_config | endpoint_unavailable}.
  MatcherWitness(wire::WireContext& context, const std::string& results_endpoint, const wire::ClientAccess& access,
                 const std::function<bool()>& stop);
  /// Says goodbye for a session, every id below `next_id` being given, and adds what the matcher has of it; warns when
  /// it had frames of that session before.
  void ask(wire::FrameSink& frames, std::uint64_t session, std::uint64_t next_id);
  [[nodiscard]] const Receipt& receipt() const noexcept { return receipts_->sum(); }

 private:
  [[nodiscard]] wire::ResultSource results() const { return {context_, endpoint_, wire::results_held, access_}; }
  wire::WireContext& context_;
  std::string endpoint_;
  wire::ClientAccess access_;
  std::optional<Receipts> receipts_;
};

}  // namespace lbea::tool
