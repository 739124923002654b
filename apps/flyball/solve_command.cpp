#include <algorithm>
#include <cstdio>
#include <iostream>
#include <limits>
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
    write(solver_.solve(problem));
  }

  /// Of a problem that there is no memory to read.
  void answer_without_memory(const std::string& beginning) {
    write(solve::Solver::without_memory(beginning));
  }

  [[nodiscard]] int status() const { return status_; }
  /// Whether somebody takes the answers.
  [[nodiscard]] bool good() const { return written_; }
  [[nodiscard]] bool empty() const { return count_ == 0; }

 private:
  void write(const solve::Answer& answer) {
    std::fwrite(answer.json.data(), 1, answer.json.size(), stdout);
    std::fputc('\n', stdout);
    written_ = std::fflush(stdout) == 0;  // as they come: whoever asked may wait for it
    ++count_;
    tell_progress("solves", count_);
    if (!answer.solved) {
      status_ = std::max<int>(status_, answer.kind == ErrorKind::no_answer ? no_answer : bad_input);
    }
  }

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

/// The lines of standard input. One that there is no memory for is answered with that, and passed
/// over.
class Lines {
 public:
  explicit Lines(Stream& stream) : stream_(stream) { std::cin.exceptions(std::ios::badbit); }

  /// @return Whether there is one more.
  bool next(std::string& line) {
    for (;;) {
      try {
        return static_cast<bool>(std::getline(std::cin, line));
      } catch (const std::bad_alloc&) {
        refuse(line);
        std::cin.clear();
        std::cin.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
      } catch (const std::ios::failure&) {  // what is no file is read
        return false;
      }
    }
  }

  /// @param line  Given back before there is an answer.
  void refuse(std::string& line) {
    const std::string beginning = line.substr(0, std::min(line.size(), looked_at));
    std::string().swap(line);
    stream_.answer_without_memory(beginning);
  }

  /// The same of an object over several lines.
  void refuse(std::vector<std::string>& lines) {
    std::string beginning;
    for (const std::string& line : lines) {
      beginning.append(line, 0, looked_at - std::min(looked_at, beginning.size())).append("\n");
    }
    std::vector<std::string>().swap(lines);
    stream_.answer_without_memory(beginning);
  }

 private:
  static constexpr std::size_t looked_at = 4096;  ///< Of its bytes, for the id.

  Stream& stream_;
};

/// The first object, which may stand on several lines; those after it are one a line.
void answer_first(Stream& stream, Lines& input) {
  std::vector<std::string> lines(1);
  while (input.next(lines[0]) && is_blank(lines[0])) {
  }
  try {
    Brackets brackets;
    const std::size_t begin = std::min(lines[0].find_first_not_of(" \t"), lines[0].size());
    const bool opens = lines[0].find_first_of("{[", begin) == begin && begin < lines[0].size();
    bool whole = !opens || brackets.closed_by(lines[0]);
    bool one = true;
    std::string line;
    while (!whole && one && input.next(line)) {
      one = continues(line);
      whole = brackets.closed_by(line);
      lines.push_back(std::move(line));
    }
    if (!one) {
      std::for_each(lines.begin(), lines.end(),
                    [&](const std::string& each) { stream.answer(each); });
    } else if (lines.size() == 1) {
      stream.answer(lines[0]);
    } else {
      stream.answer(fmt::format("{}", fmt::join(lines, "\n")));
    }
  } catch (const std::bad_alloc&) {
    input.refuse(lines);
  }
}

/// Answers what stands on standard input.
int answer_all(const std::string& kind) {
  const auto solver = solve::Solver::create(kind);
  if (!solver) {
    return refuse(solver.error());
  }
  std::ios::sync_with_stdio(false);
  Stream stream(*solver);
  Lines input(stream);
  answer_first(stream, input);
  std::string line;
  while (stream.good() && input.next(line)) {
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
