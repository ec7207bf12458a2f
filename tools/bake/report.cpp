#include "tools/bake/report.hpp"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>

namespace lbea {

void print_table(const BakeSummary& summary, const std::filesystem::path& model) {
  const auto& seconds = summary.seconds;
  const double all = seconds.reading + seconds.bases + seconds.samples + seconds.writing;
  std::printf("model          %s, %.1f MB\n", model.c_str(), static_cast<double>(summary.file_size) / 1e6);
  std::printf("samples        %u of %u simulations\n", summary.samples, summary.simulations);
  std::printf("component      %u nodes, %u elements, %u fields, %u parameters\n", summary.nodes,
              summary.elements, summary.fields, summary.parameters);
  std::printf("region         %u vertices, %u reference mesh%s\n", summary.vertices, summary.references,
              summary.references == 1 ? "" : "es");
  std::printf("basis          %u modes, eigenvalues to %.3g, residual %.1e, %s\n", summary.modes,
              summary.highest_eigenvalue, summary.basis_residual, summary.basis_solver.c_str());
  if (summary.degenerate_triangles > 0)
    std::printf("               %zu triangles without area skipped\n", summary.degenerate_triangles);
  if (std::isnan(summary.kept_variance))
    std::printf("kept variance  the samples do not vary\n");
  else
    std::printf("kept variance  %.4f %%\n", 100 * summary.kept_variance);
  std::printf("time           %.2f s: reading %.2f, bases %.2f, samples %.2f, writing %.2f\n", all,
              seconds.reading, seconds.bases, seconds.samples, seconds.writing);
}

void print_json(const BakeSummary& summary, const std::filesystem::path& model) {
  const nlohmann::ordered_json json{{"model", model.string()},
                                    {"file_size", summary.file_size},
                                    {"samples", summary.samples},
                                    {"simulations", summary.simulations},
                                    {"nodes", summary.nodes},
                                    {"elements", summary.elements},
                                    {"fields", summary.fields},
                                    {"parameters", summary.parameters},
                                    {"vertices", summary.vertices},
                                    {"references", summary.references},
                                    {"modes", summary.modes},
                                    {"highest_eigenvalue", summary.highest_eigenvalue},
                                    {"basis_residual", summary.basis_residual},
                                    {"basis_solver", summary.basis_solver},
                                    {"degenerate_triangles", summary.degenerate_triangles},
                                    {"kept_variance", summary.kept_variance},
                                    {"seconds",
                                     {{"reading", summary.seconds.reading},
                                      {"bases", summary.seconds.bases},
                                      {"samples", summary.seconds.samples},
                                      {"writing", summary.seconds.writing}}}};
  std::printf("%s\n", json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
}

}  // namespace lbea
