#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <new>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <flyball/core/progress.hpp>
#include <flyball/solve/documentation.hpp>
#include <flyball/solve/solver.hpp>

#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

bool is_blank(const std::string& line) {
  return line.find_first_not_of(" \t\r\n") == std::string::npos;
}

/// Answers problem after problem; the status is the worst that any of them asks for.
class Stream {
 public:
  explicit Stream(const solve::Solver& solver) : solver_(solver) {}

  void answer(const std::string& problem) {
    if (is_blank(problem)) {
      return;
    }
    solve::Answer answer = solver_.solve(problem);
    answer.json += '\n';
    std::fwrite(answer.json.data(), 1, answer.json.size(), stdout);
    written_ = std::fflush(stdout) == 0;  // as they come: whoever asked may wait for it
    ++count_;
    tell_progress("solves", count_);
    if (!answer.solved) {
      status_ = std::max<int>(status_, answer.kind == ErrorKind::no_answer ? no_answer : bad_input);
    }
  }

  [[nodiscard]] int status() const { return status_; }
  /// Whether somebody takes the answers.
  [[nodiscard]] bool good() const { return written_; }
  [[nodiscard]] bool empty() const { return count_ == 0; }

 private:
  const solve::Solver& solver_;
  int status_ = success;
  bool written_ = true;
  long count_ = 0;
};

/// Counts the brackets of an object that comes line by line.
class Brackets {
 public:
  /// @return Whether none is open behind the line.
  bool closed_by(const std::string& line) {
    for (const char c : line) {
      if (quoted_) {
        quoted_ = escaped_ || c != '"';
        escaped_ = !escaped_ && c == '\\';
      } else {
        quoted_ = c == '"';
        open_ += c == '{' || c == '[' ? 1 : c == '}' || c == ']' ? -1 : 0;
      }
    }
    return open_ <= 0;
  }

 private:
  long open_ = 0;
  bool quoted_ = false;
  bool escaped_ = false;
};

/// Whether a line may go on an object over several lines, even a broken one, and is no problem of
/// its own.
bool continues(const std::string& line) {
  return is_blank(line) ||
         std::string_view(" \t}]\"[,-0123456789").find(line[0]) != std::string_view::npos;
}

int refuse(const Error& error) {
  tell(error);
  print(solve::Solver::error_json(error));
  return bad_input;
}

/// Answers what stands on standard input.
int answer_all(const std::string& kind) {
  const auto solver = solve::Solver::create(kind);
  if (!solver) {
    return refuse(solver.error());
  }
  std::ios::sync_with_stdio(false);
  Stream stream(*solver);
  std::string line;
  while (std::getline(std::cin, line) && is_blank(line)) {
  }
  // The first object may stand on several lines; those after it are one a line.
  std::vector<std::string> lines{line};
  Brackets brackets;
  const std::size_t begin = std::min(line.find_first_not_of(" \t"), line.size());
  const bool opens = line.find_first_of("{[", begin) == begin && begin < line.size();
  bool whole = !opens || brackets.closed_by(line);
  bool one = true;
  while (!whole && one && std::getline(std::cin, line)) {
    lines.push_back(line);
    one = continues(line);
    whole = brackets.closed_by(line);
  }
  if (one) {
    stream.answer(fmt::format("{}", fmt::join(lines, "\n")));
  } else {
    std::for_each(lines.begin(), lines.end(),
                  [&](const std::string& each) { stream.answer(each); });
  }
  while (stream.good() && std::getline(std::cin, line)) {
    stream.answer(line);
  }
  if (stream.empty()) {
    tell(Error(ArgumentError::empty)
             .in("solve")
             .about("standard input")
             .got("empty")
             .expected("one JSON object, or one on each line"));
    return bad_input;
  }
  return stream.status();
}

struct SolveOptions {
  std::string kind;
  bool help = false;
  bool list = false;
  bool markdown = false;
  bool schema = false;
};

int run_solve(const SolveOptions& options, const CLI::App& command) {
  if (options.list || options.markdown || options.schema) {
    print(options.list       ? solve::list_of_kinds()
          : options.markdown ? solve::markdown()
                             : solve::json_schema());
    return success;
  }
  if (options.help && options.kind.empty()) {
    print(command.get_parent()->help());  // which names the program, too
    return success;
  }
  if (options.help) {
    if (const auto kind = solve::find_kind(options.kind)) {
      print(solve::help_of(**kind));
      return success;
    }
  }
  if (options.kind.empty()) {
    tell(Error(ArgumentError::empty)
             .in("solve")
             .about("KIND")
             .got("left out")
             .expected("a kind of problem, such as dare")
             .hint("flyball solve --list lists all"));
    return bad_input;
  }
  return answer_all(options.kind);
}

}  // namespace

void add_solve_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "solve", "Solve a control equation: JSON in, JSON out, one problem a line");
  command->footer(
      "Matrices are lists of rows, complex numbers [re, im], infinities \"inf\" and \"-inf\"; a "
      "field\n"
      "id is echoed.\n"
      "Exit status: 0 all solved, 1 some problem has no solution, 2 some line was no problem.\n"
      "\n  flyball solve --list         every kind of problem\n"
      "  flyball solve dare --help    the fields of one, with an example\n"
      "\n  echo '{\"A\": [[1]], \"B\": [[1]], \"Q\": [[1]], \"R\": [[1]]}' | flyball solve dare");
  auto options = std::make_shared<SolveOptions>();
  // The help of a kind is its row's, so that the option is an ordinary one.
  command->set_help_flag();
  command->add_flag("-h,--help", options->help, "Print this help, or with KIND that of the kind");
  command->add_flag("--list", options->list, "Print every kind of problem and what it solves");
  command->add_flag("--schema", options->schema,
                    "Print the JSON Schema of all problems and answers");
  command->add_flag("--markdown", options->markdown, "Print docs/solve.md")->group("");
  command->add_option("KIND", options->kind, "Which kind of problem");
  command->callback([options, command, &invocation] {
    try {
      invocation.status = run_solve(*options, *command);
    } catch (const std::bad_alloc&) {  // while reading; a problem is answered where it is solved
      invocation.status = refuse(not_enough_memory("standard input"));
    }
  });
}

}  // namespace flyball::app
