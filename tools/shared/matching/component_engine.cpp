#include "tools/shared/matching/component_engine.hpp"

#include "adapters/files/file_names.hpp"

#include <algorithm>

namespace lbea::tool {

std::string component_name(std::string_view model_file) { return io::path_of(model_file).stem().string(); }

std::vector<std::vector<std::size_t>> coupled(const std::vector<ComponentModel>& components) {
  std::vector<std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < components.size(); ++i) {
    const auto group = std::ranges::find_if(groups, [&](const std::vector<std::size_t>& known) {
      return difference_of_runs(components[known.front()].model, components[i].model).empty();
    });
    if (group == groups.end())
      groups.push_back({i});
    else
      group->push_back(i);
  }
  return groups;
}

std::string coupling_text(const std::vector<ComponentModel>& components) {
  const auto groups = coupled(components);
  std::string text;
  for (const std::vector<std::size_t>& group : groups) {
    if (!text.empty()) text += "; ";
    for (std::size_t i = 0; i < group.size(); ++i)
      text += (i == 0 ? "" : i + 1 == group.size() ? " and " : ", ") + components[group[i]].name;
    text += group.size() == 1 ? " alone" : " as one run";
    if (group.front() == 0) continue;
    const Model &first = components.front().model, &other = components[group.front()].model;
    text += ", because " + difference_of_runs(first, other);
  }
  return text;
}

namespace {

std::vector<Model> models_of(const std::vector<ComponentModel>& components) {
  std::vector<Model> models;
  for (const ComponentModel& component : components) models.push_back(component.model);
  return models;
}

}  // namespace

ModelComponents::ModelComponents(const std::vector<ComponentModel>& components, const MatcherConfig& config,
                                 const HistorySettings& settings)
    : near_none_(models_of(components), config) {
  for (const ComponentModel& component : components) {
    matchers_.emplace_back(component.model, config, component.views);
    tests_.emplace_back(component.model, config.method, component.views);
    if (config.method == Method::fit && settings.is_kept)
      histories_.push_back(history_for(component.model, config, component.views, settings));
  }
  if (config.method != Method::fit) return;
  for (const std::vector<std::size_t>& numbers : coupled(components)) {
    std::vector<TrackedComponent> tracked;
    for (const std::size_t i : numbers) tracked.push_back({components[i].model, components[i].views});
    groups_.push_back({numbers, ComponentTracker(std::move(tracked)), std::vector<MatchResult>(numbers.size())});
    for (std::size_t i = 0; i < numbers.size(); ++i) tests_[numbers[i]].set(&groups_.back().tracker.state(i));
  }
}

void ModelComponents::track_all(std::span<const MatchResult> results) noexcept {
  for (Group& group : groups_) {
    for (std::size_t i = 0; i < group.components.size(); ++i) group.results[i] = results[group.components[i]];
    group.tracker.update(group.results);
  }
}

void ModelComponents::begin_test() noexcept {
  for (ComponentTest& test : tests_) test.begin_test();
  for (TestHistory& history : histories_) history.reset();
  for (Group& group : groups_) group.tracker.reset();
}

wire::WireStatus status_of_all(std::span<const MatchResult> results) noexcept {
  Status best = results.front().status;
  for (const MatchResult& result : results)
    if (result.status == Status::ok || (result.status == Status::low_coverage && best != Status::ok))
      best = result.status;
  return to_wire(best);
}

}  // namespace lbea::tool
