/* A client behind libmodbus, to measure others against: reads and writes a PLC as fast as it answers.
 *
 * libmodbus_client PORT READ_COUNT WRITE_ADDRESS WRITE_COUNT CYCLES
 * For each line on standard input: CYCLES times one read from 0 and one write of zeros. Prints the
 * median duration of a cycle [s].
 */
#include <modbus.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static int compare(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

int main(int argc, char **argv) {
    if (argc != 6) return fputs("libmodbus_client: expected five numbers\n", stderr), 2;
    int reads = atoi(argv[2]), address = atoi(argv[3]), writes = atoi(argv[4]), n = atoi(argv[5]);
    modbus_t *client = modbus_new_tcp("127.0.0.1", atoi(argv[1]));
    uint16_t words[MODBUS_MAX_READ_REGISTERS], zeros[MODBUS_MAX_WRITE_REGISTERS] = {0};
    double *durations = calloc(n, sizeof *durations);

    modbus_set_slave(client, 1);
    if (modbus_connect(client)) return perror("libmodbus_client"), 1;
    while (getchar() == '\n') {
        for (int k = 0; k < n; k++) {
            double begun = now();
            if (modbus_read_registers(client, 0, reads, words) != reads
                || modbus_write_registers(client, address, writes, zeros) != writes)
                return perror("libmodbus_client"), 1;
            durations[k] = now() - begun;
        }
        qsort(durations, n, sizeof *durations, compare);
        printf("%.9f\n", durations[n / 2]), fflush(stdout);
    }
    modbus_close(client);
    return 0;
}
