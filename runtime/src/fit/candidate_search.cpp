#include "runtime/src/fit/candidate_search.hpp"

namespace lbea {
namespace {

std::vector<std::uint32_t> count_filled(const DepthImages& images) {
  std::vector<std::uint32_t> counts(images.depths.size() / padded_cells(images.camera));
  for (std::size_t s = 0; s < counts.size(); ++s)
    for (const std::uint16_t depth : images.of_sample(s)) counts[s] += depth != empty_cell ? 1u : 0u;
  return counts;
}

std::uint32_t most_proposed(const ModelView& model, std::uint32_t max_matches, const FitSettings& settings) {
  return std::min(std::max(settings.proposals, max_matches), model.info.samples);
}

}  // namespace

[[gnu::cold]]  // compiled for size
CandidateSearch::CandidateSearch(const ModelView& model, const DepthImages& images, std::uint32_t max_matches,
                                 const FitSettings& settings)
    : model_(model),
      images_(images),
      settings_(settings),
      code_(kernels()),
      times_(EnsembleTimes::of(model)),
      frame_(images.camera),
      surroundings_(images.camera),
      limited_(padded_cells(images.camera)),
      known_(limited_.size()),
      thinned_(images),
      by_thinned_(thinned_.empty() ? 1 : std::min(settings.proposals, model.info.samples)),
      few_(8),
      continued_(model),
      by_both_(by_thinned_.capacity()),
      filled_cells_(count_filled(images)),
      costs_(model, images.regression),
      ranking_(images.camera, std::min(settings.candidates, model.info.samples), images.metric,
               most_proposed(model, max_matches, settings), settings.sharpness),
      candidates_(ranking_.capacity()),
      residual_alone_(ranking_.capacity()) {}

void CandidateSearch::build_image(const CloudIndex& index) noexcept {
  frame_.build(index);
  std::ranges::copy(frame_.cells(), limited_.begin());
  surroundings_.limit(limited_);
}

void CandidateSearch::search(std::span<const RankedSample> proposed, const FramePrior& prior) noexcept {
  reads_copies_ = true;
  image_ = {.observed = limited_,
            .is_hidden = true,
            .prior = prior.pose,
            .points = frame_.points(),
            .is_sparse = frame_.is_sparse()};
  FrameExpectation expectation = prior.expectation != nullptr ? *prior.expectation : FrameExpectation{};
  earliest_s_ = std::numeric_limits<double>::infinity();
  const FrameExpectation* expected = prior.expectation != nullptr ? &expectation : nullptr;
  if (!proposes()) {
    if (expectation.is_first) expectation.latest = {};  // no sample is known that the test may begin at
    assess(proposed, expected);
    return rank_image();
  }
  thinned_.propose(limited_, few_, by_thinned_);
  const float most = most_explained(least_residual(limited_, few_.ranked()));
  if (expectation.is_first) expectation.begin_at(earliest_s_ = earliest_explaining(most));
  if (prior.hidden != nullptr && prior.hidden->is_confirmed_by(frame_.cells()) &&
      is_explained_with(*prior.hidden, most)) {
    image_.observed = known_;
    image_.knows_hidden = true;
  } else if (is_explained_whole(expected, most)) {
    image_.observed = frame_.cells();
    image_.is_hidden = false;
    return;
  }
  thinned_.propose(image_.observed, by_thinned_);
  assess(expected != nullptr ? propose_hidden(*expected) : by_thinned_.selected(capacity()), expected);
  rank_image();
}

/// Whether a sample that the earlier frames allow explains the whole frame. Ranks the samples proposed by it.
bool CandidateSearch::is_explained_whole(const FrameExpectation* expected, float most) noexcept {
  assess(by_thinned_.selected(capacity()), expected);
  const float least = rank(frame_.cells());
  return least + price(sample(0)) <= most;
}

/// What is seen of a frame may be similar to many samples that differ in the hidden part: those that continue the
/// earlier frames take the places of the last ones by the image.
std::span<const RankedSample> CandidateSearch::propose_hidden(const FrameExpectation& expected) noexcept {
  auto continued = continued_.find(expected);
  continued = continued.first(std::min(continued.size(), by_both_.size() / 2));
  const std::size_t places = by_both_.size() - continued.size();
  auto by_image = by_thinned_.selected(places);
  by_image = by_image.first(std::min(by_image.size(), places));
  const auto is_new = [&](const RankedSample& one) {
    return std::ranges::find(by_image, one.sample, &RankedSample::sample) == by_image.end();
  };
  const auto end = std::ranges::copy(by_image, by_both_.begin()).out;
  return {by_both_.begin(), std::ranges::copy_if(continued, end, is_new).out};
}

void CandidateSearch::assess(std::span<const RankedSample> proposed, const FrameExpectation* expected) noexcept {
  proposed_ = proposed;
  costs_.assess(proposed_, expected);
}

void CandidateSearch::search(const FrameImage& image, std::span<const RankedSample> proposed) noexcept {
  reads_copies_ = false;
  proposed_ = proposed;
  image_ = image;
  rank_image();
}

/// Greatest squared residual of a sample that explains the frame. limited: the least one without the cells that may be
/// hidden.
float CandidateSearch::most_explained(float limited) const noexcept {
  return settings_.hidden * (limited + square(images_.metric.mesh_noise / images_.camera.depth_step));
}

/// Time since the impact of the earliest sample that explains what the frame shows, s; infinite: none does. Compares
/// the most similar sample in each part of the first third of the simulations: the times of later ones vary too much.
double CandidateSearch::earliest_explaining(float most) noexcept {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  constexpr std::uint8_t parts = 16;
  if (model_.sample_times.empty()) return infinity;
  const auto since_impact = [this](std::uint32_t sample) { return model_.sample_times[sample] - times_.impact_s; };
  std::array<RankedSample, parts> best;
  best.fill({0, std::numeric_limits<float>::infinity()});
  thinned_.visit_compared([&](std::uint32_t sample, float mean) {
    const double part = since_impact(sample) / times_.late_s() * parts;
    if (!(part >= 0 && part < parts)) return;
    RankedSample& one = best[static_cast<std::size_t>(part)];
    if (mean < one.distance) one = {sample, mean};
  });
  const auto explains = [&](const RankedSample& one) {
    return std::isfinite(one.distance) && least_residual(limited_, std::span(&one, 1)) <= most;
  };
  const auto earliest = std::ranges::find_if(best, explains);
  return earliest != best.end() ? since_impact(earliest->sample) : infinity;
}

/// Whether a sample explains the whole frame but for what something hid in earlier ones. Sets known_. The samples
/// proposed by the whole frame remain.
bool CandidateSearch::is_explained_with(const HiddenCells& hidden, float most) noexcept {
  std::ranges::copy(frame_.cells(), known_.begin());
  hidden.exclude_from(known_);
  thinned_.propose(known_, few_, by_thinned_);
  return least_residual(known_, few_.ranked()) <= most;
}

/// Of whole images, squared, in depth steps.
float CandidateSearch::least_residual(std::span<const float> observed,
                                      std::span<const RankedSample> samples) const noexcept {
  float least = std::numeric_limits<float>::infinity();
  for (const RankedSample& one : samples)
    least = std::min(least, mean_square(code_, observed, images_.of_sample(one.sample).data(), ranking_.prices()));
  return least;
}

/// Hidden parts and the edges of what hides them distinguish samples but are no residual of what the frame shows: what
/// they cost the best sample is subtracted from all.
void CandidateSearch::rank_image() noexcept {
  if (image_.is_hidden)
    set_candidates(ranking_.rank_hidden(image_.observed, images_.depths, proposed_, &costs_, image_.knows_hidden));
  else
    rank(image_.observed);
}

/// Returns the least residual, squared, before hidden cells are left out.
float CandidateSearch::rank(std::span<float> observed) noexcept {
  std::span<const std::uint32_t> filled_cells;
  if (reads_copies_) filled_cells = filled_cells_;
  const float least = ranking_.rank(observed, images_.depths, proposed_, &costs_, filled_cells);
  set_candidates(price(sample(0)));
  return least;
}

/// not_residual: part of the best ones' mean squares.
void CandidateSearch::set_candidates(float not_residual) noexcept {
  const float step = images_.camera.depth_step, price_of_best = price(sample(0));
  for (std::size_t k = 0; k < count(); ++k) {
    const RankedSample& one = ranking_.ranked()[k];
    const auto length = [step](float squared_steps) { return step * std::sqrt(std::max(squared_steps, 0.0f)); };
    candidates_[k] = {model_.sample(one.sample), length(one.distance - not_residual)};
    residual_alone_[k] = length(one.distance - not_residual + price_of_best - price(one.sample));
  }
}

void CandidateSearch::update(HiddenCells& hidden) noexcept {
  hidden.remove_shown(frame_.cells());
  if (image_.is_hidden) hidden.add(ranking_.hidden_parts(frame_.cells(), images_.depths));
}

}  // namespace lbea
