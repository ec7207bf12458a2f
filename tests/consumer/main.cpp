#include <lbea/lbea.hpp>

#include <cstdio>
#include <vector>

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  try {
    const lbea::Model model = lbea::Model::open(argv[1]);
    lbea::Matcher matcher{model, {.max_matches = 3}};
    const auto positions = model.node_positions(0);
    std::vector<lbea::Point> points;
    for (std::size_t i = 0; i + 2 < positions.size(); i += 3) points.push_back({positions[i], positions[i + 1], positions[i + 2]});
    const lbea::MatchResult result = matcher.match({.id = 1, .points = points});
    const lbea::Match& best = result.matches.front();
    std::printf("%s step %u, distance %g\n", model.simulation_name(best.sample.simulation).data(), best.sample.time_step,
                static_cast<double>(best.distance));
    return result.status == lbea::Status::ok && best.sample == model.sample(0) ? 0 : 1;
  } catch (const lbea::Error& error) {
    std::printf("%s\n", error.what());
    return 1;
  }
}
