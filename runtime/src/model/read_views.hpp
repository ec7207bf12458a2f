// Sections 64 to 67 of a model: the depth images.
#pragma once

#include "runtime/src/model/section_reader.hpp"
#include "runtime/src/model/view_data.hpp"

#include <memory>

namespace lbea {

/// Null when the file has none. Throws Error{corrupt_model}.
[[nodiscard]] std::shared_ptr<const ViewData> read_views(const SectionReader& sections, const format::Info& info);

}  // namespace lbea
