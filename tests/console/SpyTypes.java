// What lcm-spy does with a message, without its window: its own database of types finds the class
// by the fingerprint, and
// the class decodes it. Reads lines "NAME HEX" and prints "NAME CLASS HEX", the bytes as the class
// encodes them again.
import lcm.lcm.LCMDataInputStream;
import lcm.spy.LCMTypeDatabase;

import java.io.BufferedReader;
import java.io.ByteArrayOutputStream;
import java.io.DataInput;
import java.io.DataOutput;
import java.io.DataOutputStream;
import java.io.InputStreamReader;
import java.nio.ByteBuffer;

public class SpyTypes {
    public static void main(String[] arguments) throws Exception {
        LCMTypeDatabase types = new LCMTypeDatabase();
        BufferedReader lines = new BufferedReader(new InputStreamReader(System.in));
        for (String line = lines.readLine(); line != null; line = lines.readLine()) {
            String[] words = line.split(" ");
            byte[] message = fromHex(words[1]);
            Class<?> type = types.getClassByFingerprint(ByteBuffer.wrap(message).getLong());
            if (type == null) {
                System.out.println("= " + words[0] + " unknown -");
                continue;
            }
            Object decoded =
                    type.getConstructor(DataInput.class)
                            .newInstance(new LCMDataInputStream(message));
            ByteArrayOutputStream encoded = new ByteArrayOutputStream();
            type.getMethod("encode", DataOutput.class)
                    .invoke(decoded, new DataOutputStream(encoded));
            System.out.println(
                    "= "
                            + words[0]
                            + " "
                            + type.getSimpleName()
                            + " "
                            + toHex(encoded.toByteArray()));
        }
    }

    private static byte[] fromHex(String text) {
        byte[] bytes = new byte[text.length() / 2];
        for (int i = 0; i < bytes.length; ++i)
            bytes[i] = (byte) Integer.parseInt(text.substring(2 * i, 2 * i + 2), 16);
        return bytes;
    }

    private static String toHex(byte[] bytes) {
        StringBuilder text = new StringBuilder();
        for (byte each : bytes) text.append(String.format("%02x", each));
        return text.toString();
    }
}
