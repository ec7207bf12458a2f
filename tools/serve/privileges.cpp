#include "tools/serve/privileges.hpp"

#include <cerrno>
#include <cstring>

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>

namespace lbea::tool {
namespace {

Privilege pin(unsigned processor) {
  cpu_set_t set;
  CPU_ZERO(&set);
  if (processor < CPU_SETSIZE) CPU_SET(processor, &set);
  const int error = processor < CPU_SETSIZE ? ::pthread_setaffinity_np(::pthread_self(), sizeof set, &set) : EINVAL;
  const std::string which = "processor " + std::to_string(processor);
  if (error == 0) return {"pin", true, "the matching thread runs on " + which};
  return {"pin", false,
          which + " is not to be had (" + std::strerror(error) + "); see taskset -cp $$ for those that are"};
}

Privilege become_realtime(int priority) {
  sched_param param{};
  param.sched_priority = priority;
  const int error = ::pthread_setschedparam(::pthread_self(), SCHED_FIFO, &param);
  const std::string which = "SCHED_FIFO priority " + std::to_string(priority);
  if (error == 0) return {"realtime", true, "the matching thread has " + which};
  return {"realtime", false,
          which + " was refused (" + std::strerror(error) +
              "); allow it with LimitRTPRIO= in the unit, "
              "rtprio in limits.conf, or CAP_SYS_NICE"};
}

// What there is stays in RAM as it is touched: locking it at once would read all of the model. What comes later stays
// from the beginning.
bool lock_all(const Model* model, Method method) {
  return ::mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0 && (model == nullptr || model->lock(method)) &&
         ::mlockall(MCL_FUTURE) == 0;
}

std::string describe(const Model* model, Method method) {
  if (model == nullptr || model->hot_bytes(method) == model->bytes()) return "all memory stays in RAM";
  constexpr std::uint64_t megabyte = 1'000'000;
  return "all memory stays in RAM; of the model " + std::to_string(model->hot_bytes(method) / megabyte) +
         " MB, the other " + std::to_string((model->bytes() - model->hot_bytes(method)) / megabyte) +
         " MB are read when they are asked for";
}

Privilege lock_memory(const Model* model, Method method) {
  if (lock_all(model, method)) return {"lock-memory", true, describe(model, method)};
  const int error = errno;
  rlimit limit{};
  ::getrlimit(RLIMIT_MEMLOCK, &limit);
  return {"lock-memory", false,
          std::string("memory could not be locked (") + std::strerror(error) + "; the limit is " +
              std::to_string(limit.rlim_cur >> 20) +
              " MB); allow it with LimitMEMLOCK=infinity "
              "in the unit or memlock in limits.conf"};
}

}  // namespace

std::vector<Privilege> ask_for_thread(const PrivilegeRequest& request) {
  std::vector<Privilege> answers;
  if (request.pin) answers.push_back(pin(*request.pin));
  if (request.realtime) answers.push_back(become_realtime(*request.realtime));
  return answers;
}

std::vector<Privilege> ask_for_process(const PrivilegeRequest& request, const Model* model, Method method) {
  if (!request.lock_memory) return {};
  return {lock_memory(model, method)};
}

void raise_descriptor_limit() noexcept {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace lbea::tool
