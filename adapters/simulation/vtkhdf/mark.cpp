#include "adapters/simulation/vtkhdf/vtkhdf.hpp"

namespace lbea::io::vtkhdf {
bool is_vtkhdf(std::string_view start) noexcept { return start.starts_with("\x89HDF\r\n\x1a\n"); }
}  // namespace lbea::io::vtkhdf
