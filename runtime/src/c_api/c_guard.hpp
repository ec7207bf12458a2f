// The one place where exceptions end before C begins.
#pragma once

#include <lbea/lbea.h>
#include <lbea/lbea.hpp>

#include <exception>
#include <new>
#include <string_view>

namespace lbea {

/// Keeps the sentence for this thread's lbea_last_error() and passes the status on. Never allocates the text.
lbea_status failed(lbea_status status, std::string_view sentence) noexcept;
[[nodiscard]] const char* last_error() noexcept;

[[nodiscard]] lbea_status to_c(Status status) noexcept;

template <typename Action>
lbea_status guarded(Action&& action) noexcept {
  try {
    return action();
  } catch (const Error& error) { return failed(to_c(error.status), error.what()); } catch (const std::bad_alloc&) {
    return failed(LBEA_OUT_OF_MEMORY, "out of memory; ask for fewer points or free some");
  } catch (const std::exception& error) { return failed(LBEA_INTERNAL_ERROR, error.what()); } catch (...) {
    return failed(LBEA_INTERNAL_ERROR, "an exception of unknown type; report it with lbea_build_info()");
  }
}

}  // namespace lbea
