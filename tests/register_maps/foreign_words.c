/* Prints the words that libmodbus makes of some values: one line each, "<how> <value> <word>...". */
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>

static void show(const char *how, const char *value, const uint16_t *words, int count)
{
    printf("%s %s", how, value);
    for (int i = 0; i < count; i++)
        printf(" %u", words[i]);
    printf("\n");
}

int main(int argc, char **argv)
{
    for (int i = 2; i < argc; i++) {
        uint16_t words[2] = {0, 0};
        if (argv[1][0] == 'i') {
            MODBUS_SET_INT32_TO_INT16(words, 0, (int32_t) strtoll(argv[i], NULL, 10));
            show("int32", argv[i], words, 2);
            words[0] = (uint16_t) strtoll(argv[i], NULL, 10);
            show("int16", argv[i], words, 1);
            continue;
        }
        const float value = strtof(argv[i], NULL);
        modbus_set_float_abcd(value, words);
        show("abcd", argv[i], words, 2);
        modbus_set_float_dcba(value, words);
        show("dcba", argv[i], words, 2);
        modbus_set_float_badc(value, words);
        show("badc", argv[i], words, 2);
        modbus_set_float_cdab(value, words);
        show("cdab", argv[i], words, 2);
        modbus_set_float(value, words);
        show("plain", argv[i], words, 2);
    }
    return 0;
}
