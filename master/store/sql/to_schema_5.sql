ALTER TABLE individuals ADD COLUMN
  objectives TEXT NOT NULL DEFAULT '' /* JSON object, of several objectives; else empty */;
