// match() promises: no allocation. Every way to the heap is counted here, over 10,000 frames, malformed ones included.
#include "tests/runtime/frames.hpp"
#include "tests/runtime/seen_plates.hpp"

#include <lbea/tracker.hpp>

#include <doctest/doctest.h>

#include <atomic>
#include <limits>
#include <random>

namespace {
thread_local std::uint64_t heap_calls = 0;
}

// glibc's own doors, so that also plain malloc in a library is seen.
extern "C" {
void* __libc_malloc(std::size_t);
void __libc_free(void*);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);

void* malloc(std::size_t size) { return ++heap_calls, __libc_malloc(size); }
void free(void* memory) { ++heap_calls, __libc_free(memory); }
void* calloc(std::size_t count, std::size_t size) { return ++heap_calls, __libc_calloc(count, size); }
void* realloc(void* memory, std::size_t size) { return ++heap_calls, __libc_realloc(memory, size); }
}

using namespace lbea;
using namespace lbea::test;

TEST_CASE("10,000 frames, malformed ones included, without one call to the heap") {
  const TemporaryFolder folder;
  bake(bent_plates(), bent_plates_description(ReferenceMode::over_time), folder / "plates.lbea", with_views());
  const AlignedBytes bytes(folder / "plates.lbea");
  const Model model = Model::view(bytes.span());
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<std::vector<Point>> frames{{}, std::vector<Point>(100, Point{nan, 0, 0}), std::vector<Point>(5'000, Point{1, 1, 1}),
                                         std::vector<Point>(300, Point{1e30f, 0, 0}), {{5, 5, 5}}};
  for (const std::uint32_t s : {0u, 5u, 11u, 23u}) frames.push_back(points_of(model, s));
  for (const Method method : {Method::lbea, Method::vtp, Method::fit}) {
    MatcherConfig config = fit_config();  // the plates' frames are in reference coordinates
    config.T_reference_sensor = identity_transform;
    config.max_points = 1'000;
    config.method = method;
    Matcher matcher(model, config);
    Tracker tracker(model);
    std::uint64_t matched = 0, refused = 0;
    const std::uint64_t before = heap_calls;
    for (std::uint64_t id = 0; id < 10'000; ++id) {
      const MatchResult result = matcher.match(
          {.id = id, .stamp_ns = static_cast<std::int64_t>(id * 1'000'003), .points = frames[id % frames.size()]});
      tracker.update(result);
      (result.matches.empty() ? refused : matched) += 1;
    }
    CHECK(heap_calls == before);
    CHECK(matched > 4'000);
    CHECK(refused > 4'000);
  }
  CHECK(heap_calls > 0);  // the counter counts
}
