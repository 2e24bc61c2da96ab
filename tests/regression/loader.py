"""Objects that are no plugins, or broken ones: one clear sentence each, and exit status 2."""
import os
import tempfile

from workshop import PLUGINS, SOURCE, compile, quern, source

LINEAR = "dem/contact.linear.c"
SCENE = str(SOURCE / "configs/two_grains.yaml")


def one_sentence(text, *expected):
    lines = [line for line in text.splitlines() if "error:" in line]
    assert len(lines) == 1, f"{len(lines)} sentences, not one:\n{text}"
    for part in expected:
        assert part in lines[0], f"'{part}' is not in\n{lines[0]}"


def refused(text, name, folder, *expected, link=()):
    """A library from C text is refused by check, describe and plan alike."""
    path = compile(text, name, folder, *link)
    for command in ("check", "describe"):
        one_sentence(quern(command, path, status=2), path, *expected)
    return path


def library(**changes):
    """A library's table alone, with some members of its own."""
    members = {"size": "sizeof(quern_library)", "abi": "QUERN_ABI", "real_size": "sizeof(quern_real)",
               "lanes": "QUERN_LANES", "param_size": "sizeof(quern_param)", "use_size": "sizeof(quern_use)",
               "name": '"x"', "version": '"1"', "license": '"MIT"', "build": '"x"', "plugin": "&plugin"}
    members.update(changes)
    table = ", ".join(f".{key} = {value}" for key, value in members.items() if value)
    return ("#include <quern/abi.h>\n"
            "static const quern_param params[] = { QUERN_END_PARAMS };\n"
            "static const quern_use uses[] = { QUERN_END_USES };\n"
            "static const quern_contact_ops ops = { .size = sizeof ops };\n"
            "static const quern_plugin plugin = { .size = sizeof plugin, .kind = QUERN_CONTACT, .dims = 3,\n"
            "\t.id = \"contact.bad\", .instance_size = 8, .params = params, .uses = uses, .ops = &ops };\n"
            "QUERN_EXPORT extern const quern_library quern_library_1;\n"
            f"const quern_library quern_library_1 = {{ {table} }};\n"
            "QUERN_EXPORT const void *used(void);\nconst void *used(void) { return &plugin; }\n")


def check_tables(folder):
    refused(library(abi="2u << 16"), "contact.bad", folder, "is built for interface 2.0, this program speaks 1.0",
            "rebuild")
    refused(library(abi="QUERN_ABI + 1"), "contact.bad", folder, "is built for interface 1.1, this program speaks 1.0")
    refused(library(size="8"), "contact.bad", folder, "is built for interface")
    refused(library(real_size="4"), "contact.bad", folder, "is built for another number format")
    refused(library(plugin="0"), "contact.bad", folder, "describes no plugin")
    refused("int quern_library_2 = 1; const char *name = \"x\";", "contact.bad", folder, "exports no quern_library_1",
            "QUERN_LIBRARY")
    newer = "__attribute__((visibility(\"default\"))) extern const int quern_library_2; const int quern_library_2 = 1;"
    refused(newer, "contact.bad", folder, "is built for interface 2, this program speaks 1")
    refused(source(LINEAR, (".kind = QUERN_CONTACT", ".kind = QUERN_BODY")), "contact.linear", folder,
            "has an id that does not begin with its kind")
    refused(source(LINEAR, (".kind = QUERN_CONTACT", ".kind = 99")), "contact.linear", folder,
            "has an id that does not begin with its kind")
    print("wrong interfaces, sizes, symbols and kinds are refused")


def check_objects(folder):
    path = os.path.join(folder, "contact.text.so")
    with open(path, "w") as file:
        file.write("this is no object\n")
    one_sentence(quern("check", path, status=2), "cannot be loaded")
    missing = source(LINEAR, ("(void)setup, (void)err;", "extern void nobody_has_this(void); nobody_has_this();"))
    refused(missing, "contact.linear", folder, "cannot be loaded", "nobody_has_this")
    one_sentence(quern("check", os.path.join(folder, "nowhere.so"), status=2), "No such file or directory")
    # the start-up code of -ffast-math flushes small numbers to zero in the whole program
    refused(source(LINEAR), "contact.linear", folder, "changes the processor's floating-point state",
            "link it without -ffast-math", link=["-ffast-math"])
    print("objects that cannot be mapped, or change arithmetic, are refused")


def check_search(folder):
    compile(source(LINEAR), "contact.linear", folder)
    twice = quern("plan", SCENE, status=2, QUERN_PLUGIN_PATH=folder + ":" + str(PLUGINS))
    one_sentence(twice, "two_grains.yaml:", "contact.linear is offered twice", folder, "remove one")
    os.remove(os.path.join(folder, "contact.linear.so"))
    compile(source(LINEAR), "contact.springy", folder)
    wrong = quern("plan", SCENE, "--set", "grains.contact=springy", status=2, QUERN_PLUGIN_PATH=folder)
    one_sentence(wrong, "--set grains.contact=springy", "calls itself contact.linear: name the file contact.linear.so")
    assert "identity: the file is contact.springy.so, the id contact.linear" in quern(
        "check", os.path.join(folder, "contact.springy.so"), status=2)
    one_sentence(quern("plan", SCENE, "--set", "grains.contact=gimp", status=2), "'gimp' is shape.gimp",
                 "a plugin of kind contact is wanted")
    one_sentence(quern("list", status=2, QUERN_PLUGIN_PATH=folder), "calls itself contact.linear")
    print("the search refuses duplicates and names that do not fit")


def check_good(folder):
    text = quern("check", compile(source(LINEAR), "contact.linear", folder), status=0)
    assert "contact.linear: " in text and "all ok" in text
    crash = source(LINEAR, ("static void force_2d(const void *self, const quern_contact_batch *b) { force(2, self, b); }",
                            "static void force_2d(const void *self, const quern_contact_batch *b) "
                            "{ force(2, self, b); if (b->n == 7) *(volatile int *)0 = 1; }"))
    text = quern("check", compile(crash, "contact.linear", folder), status=2)
    assert "contact.linear: crashed (SIGSEGV) in linear.force, 2-D, while n = 7" in text, text
    print("a plugin from outside the source tree passes; one that crashes is one sentence")


if __name__ == "__main__":
    for test in (check_tables, check_objects, check_search, check_good):
        with tempfile.TemporaryDirectory() as name:
            test(name)
