#include <atomic>
#include <chrono>
#include <csignal>
#include <map>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

#include "processes.hpp"

namespace flyball::app::processes_test {
namespace {

using End = Outcome::End;

std::map<std::size_t, Outcome> outcomes(std::size_t tasks, const Bounds& bounds,
                                        const std::function<std::string(std::size_t)>& work) {
  std::map<std::size_t, Outcome> all;
  const auto done = work_in_processes(tasks, bounds, work, [&](std::size_t task, Outcome outcome) {
    EXPECT_FALSE(all.contains(task));
    all[task] = std::move(outcome);
  });
  EXPECT_TRUE(done);
  EXPECT_EQ(all.size(), tasks);
  return all;
}

TEST(Processes, AnswerEveryTask) {
  const pid_t here = ::getpid();
  for (const std::size_t processes : {1U, 3U}) {
    const auto all = outcomes(50, {.processes = processes}, [&](std::size_t task) {
      EXPECT_NE(::getpid(), here);
      return std::string(task * 10'000, static_cast<char>('a' + task % 26));
    });
    for (const auto& [task, outcome] : all) {
      EXPECT_EQ(outcome.end, End::answered);
      EXPECT_EQ(outcome.answer, std::string(task * 10'000, static_cast<char>('a' + task % 26)));
    }
  }
  EXPECT_TRUE(outcomes(0, {}, [](std::size_t) { return std::string(); }).empty());
  EXPECT_GE(usable_processors(), 1U);
}

// What goes wrong with a task is its own outcome, in whatever process and order.
TEST(Processes, ATaskThatFailsCostsItselfAlone) {
  const auto work = [](std::size_t task) -> std::string {
    switch (task) {
      case 2:
        ::raise(SIGSEGV);
        break;
      case 3:
        throw std::bad_alloc();
      case 5:
        ::_exit(7);
      default:
        break;
    }
    return std::to_string(task);
  };
  for (const std::size_t processes : {1U, 2U, 8U}) {
    const auto all = outcomes(7, {.processes = processes}, work);
    for (const std::size_t task : {0U, 1U, 4U, 6U}) {
      EXPECT_EQ(all.at(task).end, End::answered);
      EXPECT_EQ(all.at(task).answer, std::to_string(task));
    }
    EXPECT_EQ(all.at(2).end, End::died);
    EXPECT_EQ(all.at(3).end, End::too_much_memory);
    EXPECT_EQ(all.at(5).end, End::died);
    EXPECT_EQ(all.at(5).signal, 0);
  }
}

TEST(Processes, TimeIsBounded) {
  const auto spin = [](std::size_t task) -> std::string {
    for (std::atomic<int> forever = 0; task == 1;) {
      ++forever;
    }
    return "done";
  };
  const auto all = outcomes(3, {.processes = 1, .seconds = 0.2}, spin);
  EXPECT_EQ(all.at(0).end, End::answered);
  EXPECT_EQ(all.at(1).end, End::too_long);
  EXPECT_EQ(all.at(2).end, End::answered);
  // What waits takes no processor.
  const auto begin = std::chrono::steady_clock::now();
  const auto waits = outcomes(1, {.processes = 1, .seconds = 0.05}, [](std::size_t) {
    ::sleep(60);
    return std::string();
  });
  EXPECT_EQ(waits.at(0).end, End::too_long);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
}

TEST(Processes, MemoryIsBounded) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer reserves all memory";
#endif
  const auto fill = [](std::size_t task) {
    const std::vector<char> memory(task == 1 ? 200'000'000 : 1'000'000, 'x');
    return std::string(1, memory.back());
  };
  const auto all = outcomes(3, {.processes = 1, .megabytes = 64}, fill);
  EXPECT_EQ(all.at(0).end, End::answered);
  EXPECT_EQ(all.at(1).end, End::too_much_memory);
  EXPECT_EQ(all.at(2).end, End::answered);
}

}  // namespace
}  // namespace flyball::app::processes_test
