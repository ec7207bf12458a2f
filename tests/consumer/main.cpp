// consumer MODEL: matches the last sample of the model. consumer MODEL --points: prints the nodes of this sample.
#include <lbea/lbea.hpp>

#include <cstdio>
#include <string_view>
#include <vector>

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  try {
    const lbea::Model model = lbea::Model::open(argv[1]);
    const std::uint32_t last = model.samples() - 1;
    const auto positions = model.node_positions(last);
    std::vector<lbea::Point> points;
    for (std::size_t i = 0; i + 2 < positions.size(); i += 3)
      points.push_back({positions[i], positions[i + 1], positions[i + 2]});
    if (argc > 2 && std::string_view(argv[2]) == "--points") {
      for (const auto& [x, y, z] : points)
        std::printf("%.9g %.9g %.9g\n", static_cast<double>(x), static_cast<double>(y), static_cast<double>(z));
      return 0;
    }
    lbea::Matcher matcher{model, {.max_matches = 3}};
    const lbea::MatchResult result = matcher.match({.id = 1, .points = points});
    return result.status == lbea::Status::ok && result.matches.front().sample == model.sample(last) ? 0 : 1;
  } catch (const lbea::Error& error) {  // thrown by the library
    std::printf("%s\n", error.what());
    return error.status == lbea::Status::file_not_found ? 3 : 1;
  }
}
