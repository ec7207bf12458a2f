// Channels of motions that are known in closed form, and the filter of SAE J211.
#include "precompute/channels/cfc_filter.hpp"
#include "precompute/channels/channel_series.hpp"
#include "tests/support/refusals.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <numbers>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

using Eigen::Vector3d;
constexpr double interval_s = 5e-4;

std::vector<double> even_times(std::size_t count, double interval = interval_s) {
  std::vector<double> times;
  for (std::size_t i = 0; i < count; ++i) times.push_back(interval * static_cast<double>(i));
  return times;
}

Track track_of(std::span<const double> times, const std::function<Vector3d(double)>& motion) {
  Track track;
  for (const double time : times) track.push_back(motion(time));
  return track;
}

std::vector<double> values_of(std::span<const double> times, const std::function<double(double)>& function) {
  std::vector<double> values;
  for (const double time : times) values.push_back(function(time));
  return values;
}

PlannedChannel channel_of(ChannelKind kind, ChannelComponent component = ChannelComponent::resultant,
                          std::uint32_t cfc = 0) {
  return {
      .name = "channel", .unit = "mm", .kind = kind, .component = component, .cfc = cfc, .nodes = {}, .distances = {}};
}

Eigen::Matrix3d turned(double angle) {
  return Eigen::AngleAxisd(angle, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
}

std::string refusal_of(const PlannedChannel& channel, std::span<const double> times, const std::vector<Track>& tracks) {
  try {
    (void)channel_series(channel, times, tracks);
  } catch (const Error& error) { return error.what(); }
  return "";
}

}  // namespace

TEST_CASE("derivatives are exact for the fourth power of time, beside the ends for the second, at them for the first") {
  const std::vector<double> times{0, 0.1, 0.25, 0.3, 0.55, 0.6, 0.9, 1};
  const auto motion = [](double t) { return 1 + 2 * t - 3 * t * t + 4 * t * t * t - 5 * t * t * t * t; };
  const std::vector<double> values = values_of(times, motion), slopes = derivative(times, values, times, 1);
  for (std::size_t i = 2; i + 2 < times.size(); ++i) {
    const double t = times[i];
    CHECK(slopes[i] == doctest::Approx(2 - 6 * t + 12 * t * t - 20 * t * t * t).epsilon(1e-9));
  }
  const std::vector<double> parabola = derivative(times, values_of(times, [](double t) { return t * t; }), times, 1);
  for (const std::size_t i : {1u, 6u}) CHECK(parabola[i] == doctest::Approx(2 * times[i]));
  CHECK(parabola.front() == doctest::Approx(0.1));
  CHECK(parabola.back() == doctest::Approx((1 - 0.81) / 0.1));
}

// The polynomial through five states continued the motion before the impact, in the opposite direction.
TEST_CASE("a node that an impact sets in motion never moves the other way") {
  const std::vector<double> times = even_times(31);
  const std::vector<Track> tracks{
      track_of(times, [](double t) { return Vector3d(-10'000 * std::max(t - 3e-4, 0.0), 0, 0); })};
  const auto velocity = channel_series(channel_of(ChannelKind::velocity, ChannelComponent::x, 60), times, tracks);
  const auto acceleration =
      channel_series(channel_of(ChannelKind::acceleration, ChannelComponent::x, 60), times, tracks);
  for (const double v : velocity) CHECK(v < 0);
  double gained = 0;
  for (std::size_t i = 1; i < times.size(); ++i) gained += interval_s * (acceleration[i - 1] + acceleration[i]) / 2;
  // Trapezoids of slopes count the velocities beside an end a little differently: by less than the change there.
  const double beside = std::abs(velocity[2] - velocity[0]) + std::abs(velocity[30] - velocity[28]);
  CHECK(std::abs(gained - (velocity.back() - velocity.front())) < beside);
}

TEST_CASE("the filter halves the power at 5/3 of its class, without a phase") {
  // Gain of two passes: 1 / (1 + (f / 2.0775 CFC)^4), which is 0.707 at the -3 dB frequency of SAE J211, CFC 60: 100
  // Hz.
  constexpr double rate = 20'000;
  const std::vector<double> times = even_times(8'001, 1 / rate);
  for (const double frequency : {10.0, 100.0, 300.0}) {
    const auto wave = [&](double t) { return std::sin(2 * std::numbers::pi * frequency * t); };
    const std::vector<double> values = values_of(times, wave), filtered = cfc_filtered(values, 1 / rate, 60);
    const double gain = 1 / (1 + std::pow(frequency / (2.0775 * 60), 4));
    for (std::size_t i = 2'000; i < 6'000; i += 7) CHECK(std::abs(filtered[i] - gain * values[i]) < 2e-3);
  }
  CHECK(1 / (1 + std::pow(100 / (2.0775 * 60), 4)) == doctest::Approx(std::sqrt(0.5)).epsilon(1e-3));
}

TEST_CASE("the filter passes a straight line, and keeps the first and the last value") {
  const std::vector<double> times = even_times(31);
  const std::vector<double> line = values_of(times, [](double t) { return 3 - 1000 * t; });
  const std::vector<double> filtered = cfc_filtered(line, interval_s, 60);
  for (std::size_t i = 0; i < line.size(); ++i) CHECK(filtered[i] == doctest::Approx(line[i]).epsilon(1e-9));
  const std::vector<double> bent = values_of(times, [](double t) { return std::cos(300 * t) + 50 * t; });
  CHECK(cfc_filtered(bent, interval_s, 60).front() == doctest::Approx(bent.front()).epsilon(1e-6));
  CHECK(cfc_filtered(bent, interval_s, 60).back() == doctest::Approx(bent.back()).epsilon(1e-6));
}

TEST_CASE("the velocity of a polynomial motion is right within the filter's reach of the ends") {
  const std::vector<double> times = even_times(31);
  constexpr double v0 = 12'000, a = -4e5, j = 3e7;  // mm/s, mm/s^2, mm/s^3
  const auto motion = [&](double t) { return Vector3d(v0 * t + a * t * t / 2 + j * t * t * t / 6, 5, -t); };
  const std::vector<Track> tracks{track_of(times, motion)};
  const auto velocity = channel_series(channel_of(ChannelKind::velocity, ChannelComponent::x, 60), times, tracks);
  const auto along_z = channel_series(channel_of(ChannelKind::velocity, ChannelComponent::z, 60), times, tracks);
  const auto acceleration =
      channel_series(channel_of(ChannelKind::acceleration, ChannelComponent::x, 60), times, tracks);
  // The kernel of both passes is below wc / 2 e^(-wc t / sqrt 2); beyond an end, the continuation differs by v'' t^2.
  // At the ends the velocity is that of the middle between two states.
  const double corner = 2 * std::numbers::pi * 2.0775 * 60, at_end = j * 2 * std::numbers::sqrt2 / (corner * corner),
               middle = 4e5 * interval_s / 2;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double exact = v0 + a * times[i] + j * times[i] * times[i] / 2;
    CHECK(std::abs(velocity[i] - exact) < at_end + middle);
    CHECK(along_z[i] == doctest::Approx(-1).epsilon(1e-6));
    const double inside = std::min(times[i], times.back() - times[i]);
    const double slope = 2 * corner * (at_end + middle) * std::exp(-corner * inside / std::numbers::sqrt2);
    CHECK(std::abs(acceleration[i] - (a + j * times[i])) < slope + 1);
  }
}

TEST_CASE("uneven states give the velocity at their own times") {
  std::vector<double> times = even_times(41);
  for (std::size_t i = 1; i + 1 < times.size(); ++i) times[i] += (i % 2 == 0 ? 0.2 : -0.2) * interval_s;
  const std::vector<Track> tracks{track_of(times, [](double t) { return Vector3d(100 * t + 2e4 * t * t, 0, 0); })};
  const auto velocity = channel_series(channel_of(ChannelKind::velocity, ChannelComponent::x, 60), times, tracks);
  for (std::size_t i = 0; i < times.size(); ++i)
    CHECK(std::abs(velocity[i] - (100 + 4e4 * times[i])) < 4e4 * 1.2 * interval_s / 2 + 1e-6);  // that of the ends
}

TEST_CASE("a displacement counts from the first state") {
  const std::vector<double> times = even_times(3);
  const std::vector<Track> tracks{{Vector3d(1, 2, 3), Vector3d(4, 6, 3), Vector3d(1, 2, -9)}};
  CHECK(channel_series(channel_of(ChannelKind::displacement), times, tracks) == std::vector<double>{0, 5, 12});
  CHECK(channel_series(channel_of(ChannelKind::displacement, ChannelComponent::y), times, tracks) ==
        std::vector<double>{0, 4, 0});
}

TEST_CASE("a rigid motion changes neither distances nor intrusions") {
  const std::vector<double> times = even_times(20);
  const auto moved = [&](const Vector3d& point) {
    return track_of(times,
                    [&](double t) -> Vector3d { return turned(200 * t) * point + Vector3d(3e4 * t, 7, -2e4 * t); });
  };
  const std::vector<Track> tracks{moved({50, -20, 35}), moved({0, 0, 0}), moved({10, 1, 0}), moved({-3, 12, 4})};
  for (const double distance : channel_series(channel_of(ChannelKind::distance), times, tracks))
    CHECK(distance == doctest::Approx(Vector3d(50, -20, 35).norm()));
  for (const auto component :
       {ChannelComponent::x, ChannelComponent::y, ChannelComponent::z, ChannelComponent::resultant})
    for (const double intrusion : channel_series(channel_of(ChannelKind::intrusion, component), times, tracks))
      CHECK(std::abs(intrusion) < 1e-9);
}

TEST_CASE("an intrusion is measured along the axes of the three nodes, while these turn") {
  // Axes: x to the second node, z normal to the plane. In them, the node moves by (1000 t, -2000 t, 500 t).
  const std::vector<double> times = even_times(10);
  const auto moved = [&](const Vector3d& point, const Vector3d& velocity) {
    return track_of(times, [&, velocity](double t) -> Vector3d { return turned(300 * t) * (point + velocity * t); });
  };
  const Vector3d still(0, 0, 0);
  const std::vector<Track> tracks{moved({5, 5, 5}, {1000, -2000, 500}), moved({0, 0, 0}, still),
                                  moved({10, 0, 0}, still), moved({3, 12, 0}, still)};
  const auto at = [&](ChannelComponent component) {
    return channel_series(channel_of(ChannelKind::intrusion, component), times, tracks);
  };
  for (std::size_t i = 0; i < times.size(); ++i) {
    CHECK(std::abs(at(ChannelComponent::x)[i] - 1000 * times[i]) < 1e-9);
    CHECK(std::abs(at(ChannelComponent::y)[i] + 2000 * times[i]) < 1e-9);
    CHECK(std::abs(at(ChannelComponent::z)[i] - 500 * times[i]) < 1e-9);
  }
}

TEST_CASE("what a run's states do not determine is refused") {
  const std::vector<double> times = even_times(31), few = even_times(4);
  const auto standing = [](std::span<const double> at) {
    return std::vector<Track>{track_of(at, [](double) { return Vector3d(1, 2, 3); })};
  };
  const PlannedChannel velocity = channel_of(ChannelKind::velocity, ChannelComponent::x, 60);
  CHECK(refusal_of(velocity, few, standing(few)).find("4 states and a derivative or filter needs 5") !=
        std::string::npos);
  // States 0.5 ms apart: 2000 per second, enough for class 200.
  CHECK(refusal_of(channel_of(ChannelKind::velocity, ChannelComponent::x, 200), times, standing(times)).empty());
  CHECK(refusal_of(channel_of(ChannelKind::velocity, ChannelComponent::x, 201), times, standing(times))
            .find("give at most cfc = 200") != std::string::npos);
  // Half a period is 0.3 s over the class: 15 ms are enough for class 20.
  CHECK(refusal_of(channel_of(ChannelKind::velocity, ChannelComponent::x, 20), times, standing(times)).empty());
  CHECK(refusal_of(channel_of(ChannelKind::velocity, ChannelComponent::x, 19), times, standing(times))
            .find("give at least cfc = 20") != std::string::npos);
  std::vector<double> repeated = times;
  repeated[7] = repeated[6];
  CHECK(refusal_of(velocity, repeated, standing(times)).find("time of state 7 is not later") != std::string::npos);
  const std::vector<Track> on_a_line{Track(31, Vector3d(1, 1, 1)), Track(31, Vector3d(0, 0, 0)),
                                     Track(31, Vector3d(1, 0, 0)), Track(31, Vector3d(2, 0, 0))};
  CHECK(refusal_of(channel_of(ChannelKind::intrusion), times, on_a_line).find("lie on a line in state 0") !=
        std::string::npos);
}
