#include "precompute/survey/survey.hpp"

#include "precompute/mapping/body_frame.hpp"
#include "precompute/mapping/mapped_run.hpp"
#include "precompute/parallel.hpp"
#include "precompute/survey/envelope.hpp"
#include "precompute/survey/model_runs.hpp"
#include "precompute/work/bake_plan.hpp"

#include <map>
#include <numeric>
#include <set>

namespace lbea::bake {
namespace {
void check(const Ensemble& ensemble, const EnsembleDescription& description) {
  if (ensemble.runs.empty()) throw Error(Status::bad_config, "the ensemble has no runs; name at least one");
  if (ensemble.reference_run >= ensemble.runs.size())
    throw Error(Status::bad_config, "the reference run is not one of the ensemble's");
  if (!(description.time_factor > 0 && description.time_factor < std::numeric_limits<double>::infinity()))
    throw Error(Status::bad_config,
                "the time factor must be positive, it is " + std::to_string(description.time_factor));
  if (std::ranges::find(length_units, description.length_unit, &LengthUnit::name) == length_units.end()) {
    std::string known;
    for (const LengthUnit& unit : length_units) known += (known.empty() ? "" : ", ") + std::string(unit.name);
    throw Error(Status::bad_config, "length_unit is \"" + description.length_unit + "\"; give one of " + known);
  }
  std::set<std::string> names;
  for (const EnsembleRun& run : ensemble.runs) {
    if (!names.insert(run.name).second)
      throw Error(Status::bad_config,
                  "two runs are called '" + run.name + "'; results could not tell them apart, rename one");
    if (run.parameters.size() != ensemble.parameter_names.size())
      throw Error(Status::bad_config, "run " + run.name + " has " + std::to_string(run.parameters.size()) +
                                          " parameters, not " + std::to_string(ensemble.parameter_names.size()));
  }
}

using Paths = std::vector<std::filesystem::path>;

/// Surveys the run unless its survey is already in the work folder. files: set to those of this run alone.
PlannedRun surveyed(const WorkFolder& work, const EnsembleRun& run, const EnsembleDescription& description,
                    const SimulationReader& reference, std::uint64_t common_key, Stage& stage, Paths& files) {
  PlannedRun planned;
  const auto reader = run.open();
  files = reader->files();
  const Paths all = all_files(*reader);
  planned.modified = last_changes(all);
  planned.survey = survey_key(common_key, run.name, all, planned.modified);
  if (!work.has(planned.survey_name()))
    write_survey(work, planned, survey_run(*reader, run, description, reference, stage));
  return planned;
}

/// Two runs that read the same file would be the same simulation twice. files: per run.
void refuse_shared_files(const Ensemble& ensemble, const std::vector<Paths>& files) {
  std::map<std::filesystem::path, std::size_t> readers;
  for (std::size_t run = 0; run < files.size(); ++run) {
    if (!ensemble.runs[run].files.empty()) continue;  // read from a model that has several runs
    for (const auto& file : files[run])
      if (const auto other = readers.emplace(std::filesystem::weakly_canonical(file), run).first->second; other != run)
        throw Error(Status::bad_config, "the runs '" + ensemble.runs[other].name + "' and '" + ensemble.runs[run].name +
                                            "' both read " + file.string() +
                                            "; name each run once, by its folder or its first file");
  }
}

std::vector<PlannedRun> read_runs(const WorkFolder& work, const Ensemble& ensemble,
                                  const EnsembleDescription& description, const SimulationReader& reference,
                                  const std::vector<std::size_t>& runs, const BakeOptions& options) {
  std::vector<PlannedRun> planned(ensemble.runs.size());
  const std::uint64_t common_key = survey_key(reference.mesh(), description);
  Stage stage(options, "reading", runs.size());
  std::vector<Paths> files(ensemble.runs.size());
  work_in_parallel(runs.size(), options.workers(), [&](const auto& next) {
    for (std::size_t i = next(); i < runs.size(); i = next()) {
      try {
        planned[runs[i]] =
            surveyed(work, ensemble.runs[runs[i]], description, reference, common_key, stage, files[runs[i]]);
      } catch (const Error& error) {
        if (!options.leaves_out_broken || error.status == Status::write_failed) throw;
        planned[runs[i]].failure = error.what();
      }
      stage.step();
    }
  });
  refuse_shared_files(ensemble, files);
  return planned;
}

// Values rounded over a whole mesh cannot be rounded again over a part of it without increasing the error.
void check_rounded(const Ensemble& ensemble, const Survey& survey) {
  for (const EnsembleRun& run : ensemble.runs)
    if (run.rounded_elements != 0 && run.rounded_elements != survey.mesh.elements.size())
      throw Error(Status::bad_config,
                  "run " + run.name +
                      " is taken from a model with fields in 16 bits, but the other runs leave it only " +
                      std::to_string(survey.mesh.elements.size()) + " of its " + std::to_string(run.rounded_elements) +
                      " elements; bake from the runs' own files");
}

/// Reads the survey of a run; surveys the run again when the file is damaged.
RunHistory history_of(const WorkFolder& work, const EnsembleRun& run, const PlannedRun& planned,
                      const EnsembleDescription& description, const SimulationReader& reference,
                      const BakeOptions& options) {
  try {
    return read_survey(work, planned);
  } catch (const DamagedWorkFile& damaged) { work.remove(damaged); }
  Stage stage(options, "reading", 1);
  write_survey(work, planned, survey_run(*run.open(), run, description, reference, stage));
  return read_survey(work, planned);
}

/// All runs open with nodes and elements of the reference run.
Ensemble with_one_mesh(Ensemble ensemble, const EnsembleDescription& description) {
  map_runs(ensemble, description, std::vector<bool>(ensemble.runs.size(), true));
  return ensemble;
}

void require_reference(const BakePlan& plan) {
  const std::string& failure = plan.runs[plan.ensemble.reference_run].failure;
  if (!failure.empty())
    throw Error(Status::bad_input, "the reference run cannot be read, and cannot be left out: " + failure);
}

void collect(const WorkFolder& work, BakePlan& plan, const SimulationReader& reference, const BakeOptions& options) {
  const std::vector<EnsembleRun>& runs = plan.ensemble.runs;
  SurveyCollection collection(reference, plan.description, runs[plan.ensemble.reference_run].name);
  for (std::size_t run = 0; run < runs.size(); ++run) {
    std::string& failure = plan.runs[run].failure;
    try {
      if (failure.empty())
        collection.add(history_of(work, runs[run], plan.runs[run], plan.description, reference, options),
                       runs[run].name);
    } catch (const Error& error) {
      if (!options.leaves_out_broken) throw;
      failure = error.what();
    }
    if (!failure.empty()) collection.add_nothing();
  }
  require_reference(plan);
  plan.survey = collection.finish();
}
}  // namespace

void survey_some(const WorkFolder& work, const Ensemble& ensemble, const EnsembleDescription& as_given,
                 const std::vector<std::size_t>& runs, const BakeOptions& options) {
  const EnsembleDescription description = with_rigid_motion(as_given);
  check(ensemble, description);
  work.create();
  const Ensemble mapped = with_one_mesh(ensemble, description);
  const auto reference = mapped.runs[mapped.reference_run].open();
  (void)read_runs(work, mapped, description, *reference, runs, options);
}

BakePlan survey_runs(const WorkFolder& work, const Ensemble& ensemble, const EnsembleDescription& as_given,
                     const BakeOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  BakePlan plan;
  plan.description = with_rigid_motion(as_given);
  const EnsembleDescription& description = plan.description;
  check(ensemble, description);
  work.create();
  plan.ensemble = with_one_mesh(ensemble, description);
  const auto reference = ensemble.runs[ensemble.reference_run].open();
  std::vector<std::size_t> all(ensemble.runs.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  plan.runs = read_runs(work, plan.ensemble, description, *reference, all, options);
  collect(work, plan, *reference, options);
  if (model_lacks_elements(work, plan, reference->mesh())) {
    plan.ensemble = with_one_mesh(from_own_files(ensemble), description);
    plan.runs = read_runs(work, plan.ensemble, description, *reference, all, options);
    collect(work, plan, *reference, options);
    plan.survey.warnings.emplace_back(
        "the earlier model lacks elements that the component has with the new runs; all runs were read from their "
        "files");
  }
  check_rounded(plan.ensemble, plan.survey);
  (void)EnvelopeBuilder(plan.survey.min, plan.survey.max, description.margin());  // throws if the margin is bad
  plan.reading_seconds = seconds_since(begin);
  return plan;
}
}  // namespace lbea::bake
