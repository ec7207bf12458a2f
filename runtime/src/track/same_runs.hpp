// The runs of several models, by their names.
#pragma once

#include <lbea/lbea.hpp>

#include <vector>

namespace lbea {

/// Per simulation of `from`: the number in `to` of the one with the same name; to.simulations(): none.
[[nodiscard]] std::vector<std::uint32_t> numbers_by_name(const Model& from, const Model& to);

}  // namespace lbea
