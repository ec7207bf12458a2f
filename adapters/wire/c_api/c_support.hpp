// What the files of the C interface of frames and results share: errors and options.
#pragma once

#include "adapters/wire/access/keys.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "runtime/src/c_api/growing_structs.hpp"

#include <lbea/wire.h>
#include <lbea/lbea.hpp>

#include <chrono>
#include <exception>
#include <new>

namespace lbea::wire {
/// Stores the sentence for this thread's lbea_wire_last_error() and returns the status. Does not allocate.
lbea_wire_status failed(lbea_wire_status status, std::string_view sentence) noexcept;
inline lbea_wire_status bad_argument(std::string_view sentence) noexcept {
  return failed(LBEA_WIRE_BAD_ARGUMENT, sentence);
}

[[nodiscard]] lbea_wire_status to_c(Status status) noexcept;
/// Of a connection that does not answer. option: of lbea-serve, with this endpoint.
lbea_wire_status not_connected(Link link, const std::string& endpoint, const char* option);

/// Calls `action` and turns an exception into a status: no exception may reach C.
template <typename Action>
lbea_wire_status guarded(Action&& action) noexcept {
  try {
    return action();
  } catch (const Error& error) { return failed(to_c(error.status), error.what()); } catch (const std::bad_alloc&) {
    return failed(LBEA_WIRE_OUT_OF_MEMORY, "out of memory; send fewer points or free some");
  } catch (const std::exception& error) { return failed(LBEA_WIRE_INTERNAL_ERROR, error.what()); } catch (...) {
    return failed(LBEA_WIRE_INTERNAL_ERROR, "an exception of unknown type");
  }
}

/// Writes `full` into `*out`, which begins in the first version's size `least`.
template <typename T>
lbea_wire_status write_out(const T& full, T* out, std::size_t least) noexcept {
  if (!is_plausible_size(out->struct_size, least)) return bad_argument(size_not_set);
  write_c_struct(full, out);
  return LBEA_WIRE_OK;
}

/// Times in ms beyond a month would be negative for ZeroMQ.
inline std::chrono::milliseconds to_ms(std::uint32_t ms) noexcept {
  return std::chrono::milliseconds(std::min<std::uint32_t>(ms, 0x7fffffff));
}

struct OpenOptions {
  ClientAccess access;
  std::chrono::milliseconds patience;
  std::uint32_t queued_messages;
};
/// Throws Error{bad_config} for an inproc endpoint, which reaches no other process.
void refuse_own_process(const std::string& endpoint);
/// `options`: null for the defaults.
[[nodiscard]] bool has_known_size(const lbea_wire_options* options) noexcept;
/// `options`: null, or of a known size. `queued_by_default`: of this kind of socket. Throws Error.
[[nodiscard]] OpenOptions read_options(const lbea_wire_options* options, std::uint32_t queued_by_default);
}  // namespace lbea::wire
