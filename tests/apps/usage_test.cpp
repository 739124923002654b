// What a newcomer types first, and what a shell, a pager and a program get of it.
#include <iterator>
#include <sstream>

#include <nlohmann/json.hpp>

#include "run.hpp"

namespace flyball::test::usage_test {
namespace {

using Json = nlohmann::json;

class Usage : public Command {};

bool is_ascii(const std::string& text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

std::size_t widest(const std::string& text) {
  std::istringstream lines(text);
  std::size_t width = 0;
  for (std::string line; std::getline(lines, line);) {
    width = std::max(width,
                     static_cast<std::size_t>(std::count_if(line.begin(), line.end(), [](char c) {
                       return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
                     })));
  }
  return width;
}

TEST_F(Usage, HelpAndVersionAreCommands) {
  EXPECT_EQ(run("help").out, run("--help").out);
  EXPECT_EQ(run("help tune").out, run("tune --help").out);
  EXPECT_EQ(run("version").out, run("--version").out);
  const Answer wrong = run("help tuen");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_TRUE(holds(wrong.err, "did you mean \"tune\"?")) << wrong.err;
  EXPECT_TRUE(holds(run("help").out, "completion"));
}

TEST_F(Usage, JsonAnswersWrongCommandLines) {
  for (const char* arguments :
       {"tune a.json --frobnicate --json", "tnue a.json --json", "design --json", "--json"}) {
    const Answer answer = run(arguments);
    EXPECT_EQ(answer.status, 2) << arguments;
    const Json json = Json::parse(answer.out, nullptr, false);
    ASSERT_FALSE(json.is_discarded()) << arguments << ": " << answer.out;
    EXPECT_EQ(json.at("schema"), "flyball.usage/1");
    EXPECT_EQ(json.at("error").at("code"), "usage");
    EXPECT_FALSE(json.at("error").at("message").get<std::string>().empty());
    EXPECT_FALSE(answer.err.empty());
  }
  EXPECT_TRUE(run("tnue a.json").out.empty());
}

TEST_F(Usage, MotorsThatShareAWordAreListed) {
  const Answer krakens = run("motors kraken");
  EXPECT_EQ(krakens.status, 0) << krakens.err;
  for (const char* name : {"Kraken X60", "Kraken X60 FOC", "Kraken X44", "Kraken X44 FOC"}) {
    EXPECT_TRUE(holds(krakens.out, name)) << krakens.out;
  }
  EXPECT_FALSE(holds(krakens.out, "Falcon"));
  EXPECT_EQ(Json::parse(run("motors kraken --json").out).at("motors").size(), 4U);
  EXPECT_EQ(run("motors hamster").status, 2);
}

TEST_F(Usage, Units) {
  const Answer all = run("units");
  EXPECT_EQ(all.status, 0);
  for (const char* name : {"mph", "in/min", "rpm", "kgm2", "mOhm"}) {
    EXPECT_TRUE(holds(all.out, name)) << name;
  }
  EXPECT_FALSE(holds(run("units velocity").out, "degree/second"));
  const Json json = Json::parse(run("units \"moment of inertia\" --json").out);
  EXPECT_EQ(json.at("dimensions").at(0).at("si"), "kg m^2");
  const Answer wrong = run("units velocty");
  EXPECT_EQ(wrong.status, 2);
  EXPECT_TRUE(holds(wrong.err, "did you mean \"velocity\"?")) << wrong.err;
}

TEST_F(Usage, TablesAreFoldedToTheTerminal) {
  const std::string command = std::string("'") + FLYBALL_COMMAND + "' ";
  for (const int columns : {60, 80, 120}) {
    const std::string set = "motors >/dev/null; COLUMNS=" + std::to_string(columns) + ' ' + command;
    const Answer motors = run(set + "motors");
    EXPECT_LE(widest(motors.out), static_cast<std::size_t>(columns)) << motors.out;
    EXPECT_TRUE(holds(motors.out, "Kv rad/s/V"));
    const Answer units = run(set + "units");
    EXPECT_LE(widest(units.out), static_cast<std::size_t>(columns)) << units.out;
  }
}

// What an option means is folded behind its name, or under it; nothing of it is lost.
TEST_F(Usage, HelpIsFoldedToTheTerminal) {
  const std::string command = std::string("'") + FLYBALL_COMMAND + "' ";
  const auto words = [](const std::string& text) {
    std::istringstream in(text);
    return std::vector<std::string>(std::istream_iterator<std::string>(in), {});
  };
  const auto help = [&](const std::string& of, int columns) {
    return run("motors >/dev/null; LC_ALL=C.UTF-8 COLUMNS=" + std::to_string(columns) + ' ' +
               command + of + " --help")
        .out;
  };
  for (const char* of : {"tune", "design", "estimate", "localize"}) {
    const std::string whole = help(of, 160);
    for (const int columns : {40, 60, 80, 120}) {
      const std::string folded = help(of, columns);
      EXPECT_EQ(words(folded), words(whole)) << of << columns;
      // Names and examples keep their lines.
      std::istringstream lines(folded);
      for (std::string line; std::getline(lines, line);) {
        const bool meaning = line.starts_with("      ");
        const bool entry = columns >= 60 && line.starts_with("  -");
        const bool prose = !line.starts_with(" ");
        EXPECT_TRUE(!(meaning || entry || prose) ||
                    widest(line) <= static_cast<std::size_t>(columns))
            << line;
      }
    }
  }
  EXPECT_TRUE(holds(help("tune", 100), "\n  --run N:FROM..TO,…          What to use of single"));
  EXPECT_TRUE(is_ascii(run("motors >/dev/null; LC_ALL=C " + command + "help tune").out));
}

// What is asked for goes before what the terminal has.
TEST_F(Usage, ColumnsGoBeforeTheTerminalsWidth) {
  write("narrow.py",
        "import fcntl, os, pty, struct, subprocess, sys, termios\n"
        "master, slave = pty.openpty()\n"
        "fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack('HHHH', 50, int(sys.argv[1]), 0, 0))\n"
        "subprocess.run([sys.argv[2], 'motors'], stdout=slave, check=True)\n"
        "os.close(slave)\n"
        "text = b''\n"
        "try:\n"
        "    while True: text += os.read(master, 65536)\n"
        "except OSError: pass\n"
        "print(text.decode().count('Kv rad/s/V'), text.decode().count('Falcon 500 FOC'))\n");
  const std::string command = std::string(" '") + FLYBALL_COMMAND + "'";
  const std::string set = "motors >/dev/null; TERM=xterm NO_COLOR=1 LC_ALL=C.UTF-8 ";
  // Where the table does not fit it is two below each other, each with the motors' names.
  EXPECT_EQ(run(set + "python3 narrow.py 120" + command).out, "1 1\n");
  EXPECT_EQ(run(set + "python3 narrow.py 60" + command).out, "1 2\n");
  EXPECT_EQ(run(set + "COLUMNS=60 python3 narrow.py 120" + command).out, "1 2\n");
  EXPECT_EQ(run(set + "COLUMNS=none python3 narrow.py 60" + command).out, "1 2\n");
}

TEST_F(Usage, PlainAsciiWhereTheLocaleHasNoMore) {
  const std::string command = std::string("'") + FLYBALL_COMMAND + "' ";
  EXPECT_TRUE(holds(run("motors >/dev/null; LC_ALL=C.UTF-8 " + command + "motors").out, "mΩ"));
  for (const char* locale : {"C", "POSIX", "de_DE.ISO-8859-1"}) {
    const std::string set = std::string("motors >/dev/null; LC_ALL=") + locale + ' ' + command;
    const Answer motors = run(set + "motors");
    EXPECT_TRUE(is_ascii(motors.out)) << motors.out;
    EXPECT_TRUE(holds(motors.out, "R mOhm"));
    EXPECT_TRUE(is_ascii(run(set + "motors Zürich").err));
    EXPECT_TRUE(holds(run(set + "motors neo --json").out, "\"NEO\""));
  }
}

TEST_F(Usage, BashCompletesCommandsOptionsAndValues) {
  const std::string command = std::string("'") + FLYBALL_COMMAND + "' ";
  write("complete.sh",
        "source ./flyball.bash\nCOMP_WORDS=(\"$@\")\nCOMP_CWORD=$(($# - 1))\n_flyball\n"
        "printf '%s\\n' \"${COMPREPLY[@]}\"\n");
  ASSERT_EQ(run("completion bash >flyball.bash; bash -n flyball.bash").status, 0);
  const auto completed = [&](const std::string& words) {
    return run("version >/dev/null; bash complete.sh flyball " + words).out;
  };
  EXPECT_EQ(completed("tu"), "tune\n");
  EXPECT_TRUE(holds(completed("tune --mech"), "--mechanism\n"));
  EXPECT_TRUE(holds(completed("motors Kraken"), "Kraken\\ X60\\ FOC\n"));
  EXPECT_EQ(completed("solve dar"), "dare\n");
  EXPECT_EQ(completed("help expe"), "experiment\n");
  EXPECT_EQ(run("completion tcsh").status, 2);
  for (const char* shell : {"zsh", "fish"}) {
    const Answer text = run(std::string("completion ") + shell);
    EXPECT_EQ(text.status, 0);
    EXPECT_TRUE(holds(text.out, "--mechanism") || holds(text.out, "-l mechanism")) << text.out;
  }
}

// Every command and option is in the manual page, and no line of text begins as a request.
TEST_F(Usage, ManualPage) {
  const std::string page = run("manual").out;
  EXPECT_TRUE(page.starts_with(".TH FLYBALL 1"));
  EXPECT_TRUE(is_ascii(page));
  for (const char* part : {".SS tune", ".SS localize", "\\-\\-mechanism", "EXIT STATUS"}) {
    EXPECT_TRUE(holds(page, part)) << part;
  }
  std::istringstream lines(page);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('.')) {
      EXPECT_TRUE(line.starts_with(".TH ") || line.starts_with(".S") || line.starts_with(".B ") ||
                  line.starts_with(".I ") || line == ".nf" || line == ".fi" || line == ".TP" ||
                  line == ".PP")
          << line;
    }
  }
}

}  // namespace
}  // namespace flyball::test::usage_test
