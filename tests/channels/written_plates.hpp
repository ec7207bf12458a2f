// bent_plates() whose solver wrote histories, and descriptions with these as channels. Link lbea_precompute.
#pragma once

#include "tests/support/synthetic_model.hpp"

namespace lbea::test {

inline constexpr std::uint32_t no_state = 99;

/// What the solver wrote: exact in single precision.
inline double written(std::uint32_t run, std::uint32_t state, std::uint32_t place) {
  return 1000.0 * run + 16.0 * state * state + 0.25 * place;
}

inline std::vector<SimulationHistory> some_histories() {
  return {{"kinetic_energy"},
          {"part_mass", HistoryOwner::part, {7, 3}},
          {"part_velocity_x", HistoryOwner::part, {7, 3}},
          {"rigid_wall_force", HistoryOwner::wall, {1}}};
}

/// A state whose numbers are all this one.
struct BadState {
  std::uint32_t state = no_state;
  double value = 0;
};

class WrittenPlate : public SyntheticSimulation {
 public:
  WrittenPlate(const SyntheticSimulation& plate, std::uint32_t run, std::vector<SimulationHistory> histories,
               BadState bad = {})
      : SyntheticSimulation(plate), run_(run), histories_(std::move(histories)), bad_(bad) {}
  std::vector<SimulationHistory> histories() override { return histories_; }
  HistorySeries history_series(std::uint32_t) override { return series_; }
  /// Of every history, as if the solver had written it apart from the states.
  void set_series(HistorySeries series) { series_ = std::move(series); }
  double history(std::uint32_t state, std::uint32_t place) override {
    return state == bad_.state ? bad_.value : written(run_, state, place);
  }

 private:
  std::uint32_t run_;
  std::vector<SimulationHistory> histories_;
  BadState bad_;
  HistorySeries series_;
};

/// bent_plates() with histories. bad: of the last run.
inline Ensemble written_plates(BadState bad = {}) {
  Ensemble ensemble = bent_plates();
  for (std::uint32_t run = 0; run < ensemble.runs.size(); ++run)
    ensemble.runs[run].open = [run, bad, is_last = run + 1 == ensemble.runs.size()] {
      return std::make_unique<WrittenPlate>(bending_plate(final_angle(run), 6), run, some_histories(),
                                            is_last ? bad : BadState{});
    };
  return ensemble;
}

inline ChannelDescription history(SolverHistory source, std::uint32_t cfc = 0) {
  ChannelDescription channel;
  channel.name = "the " + source.name;
  channel.kind = ChannelKind::history;
  channel.history = std::move(source);
  channel.unit = "J";
  channel.cfc = cfc;
  return channel;
}

inline ChannelDescription energy(std::uint32_t cfc = 0) { return history({"kinetic_energy"}, cfc); }

inline EnsembleDescription with_histories(std::vector<ChannelDescription> channels) {
  EnsembleDescription description = bent_plates_description();
  description.channels = std::move(channels);
  return description;
}

inline std::vector<ChannelDescription> all_kinds() {
  return {energy(), history({"part_mass", HistoryOwner::part, 3}), history({"part_velocity_x", HistoryOwner::part, 7}),
          history({"rigid_wall_force", HistoryOwner::wall, 1})};
}

}  // namespace lbea::test
