// What the matcher that frames are replayed to says of them.
#pragma once

#include "tools/shared/intake/receipt.hpp"

#include <functional>
#include <optional>

namespace lbea {

class MatcherWitness {
 public:
  /// Waits for the first word of the matcher whose results are there. Throws Error{bad_config | endpoint_unavailable}.
  MatcherWitness(WireContext& context, const std::string& results_endpoint, const ClientAccess& access, const std::function<bool()>& stop);
  /// Says goodbye for a session, every id below `next_id` being given, and adds what the matcher has of it; warns when it had frames of that session before.
  void ask(FrameSink& frames, std::uint64_t session, std::uint64_t next_id);
  [[nodiscard]] const Receipt& receipt() const noexcept { return receipts_->sum(); }

 private:
  [[nodiscard]] ResultSource results() const { return {context_, endpoint_, results_held, access_}; }
  WireContext& context_;
  std::string endpoint_;
  ClientAccess access_;
  std::optional<Receipts> receipts_;
};

}  // namespace lbea
