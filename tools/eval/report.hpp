// What an evaluation leaves behind: a table on the screen, CSV, and meshes for ParaView.
#pragma once

#include "tools/eval/live.hpp"

#include <lbea/lbea.hpp>

#include <cstdint>
#include <filesystem>
#include <string>

namespace lbea::tool {

[[nodiscard]] std::string table_header(const Model& model);
[[nodiscard]] std::string table_line(const LiveRow& row);
[[nodiscard]] std::string table_summary(const LiveSummary& summary, const Model& model);
[[nodiscard]] std::string to_json(const LiveSummary& summary);

/// One line per frame. Throws Error{write_failed}.
void write_csv(const std::filesystem::path& file, const LiveSummary& summary);

/// The matched sample's whole mesh with all its fields as FOLDER/matched_<frame>.vtu, the series as matched.pvd;
/// matched by fit also the shape between the samples with its inferred fields and their spread, estimate_<frame>.vtu
/// and estimate.pvd; and, with a truth and a pose, each cloud in reference coordinates as frame_<frame>.ply. Throws
/// Error{write_failed}.
void write_meshes(const std::filesystem::path& folder, const LiveSummary& summary, const Model& model,
                  const Truth* truth, const RigidTransform& T_reference_sensor);

}  // namespace lbea::tool
