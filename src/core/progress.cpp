#include <flyball/core/progress.hpp>

#include <atomic>

namespace flyball {

namespace {

std::atomic<const char*> stage_now{nullptr};
std::atomic<std::size_t> done_now{0};
std::atomic<std::size_t> of_now{0};

}  // namespace

void tell_progress(const char* stage, std::size_t done, std::size_t of) noexcept {
  stage_now.store(stage, std::memory_order_relaxed);
  done_now.store(done, std::memory_order_relaxed);
  of_now.store(of, std::memory_order_relaxed);
}

Progress progress() noexcept {
  return {stage_now.load(std::memory_order_relaxed), done_now.load(std::memory_order_relaxed),
          of_now.load(std::memory_order_relaxed)};
}

}  // namespace flyball
