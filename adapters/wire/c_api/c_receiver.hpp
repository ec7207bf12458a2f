// The handle of a receiver in C.
#pragma once

#include "adapters/wire/c_api/c_support.hpp"
#include "adapters/wire/sockets/client.hpp"

#include <vector>

struct lbea_wire_receiver {
  lbea_wire_receiver(std::string address, const lbea::wire::OpenOptions& options)
      : endpoint(std::move(address)),
        results(context, endpoint, options.access, static_cast<int>(options.queued_messages)) {}
  /// The result with its lists, which live in this handle.
  [[nodiscard]] lbea_wire_result to_c(const lbea::wire::WireResult& from);

  std::string endpoint;
  lbea::wire::WireContext context;
  lbea::wire::ResultReceiver results;
  const lbea::wire::WireResult* pending = nullptr;  // received before the first call of receive
  const lbea::wire::WireResult* latest = nullptr;   // also after calls without a result
  std::vector<lbea_wire_match> matches;
  std::vector<lbea_wire_candidate> candidates;
  std::vector<lbea_wire_share> estimate;
  std::vector<lbea_wire_channel> channels;
  std::vector<lbea_wire_rig_frame> rigs;
  std::vector<lbea_wire_chance> chances;
};

namespace lbea::wire {
/// Size of lbea_wire_result in the first version that had it.
inline constexpr std::size_t least_wire_result = offsetof(lbea_wire_result, total_ns) + sizeof(std::uint32_t);
}  // namespace lbea::wire
