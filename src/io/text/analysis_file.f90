! SPDX-License-Identifier: MIT
!> Reader of analysis files (.df, .ana), both dialects. Format: docs/file-formats.md.
module rockdda_io_analysis_file
   use rockdda_base_kinds, only : wp, i8
   use rockdda_base_strings, only : counted, to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_model_analysis_input, only : analysis_input_type, dialect
   use rockdda_io_analysis_body, only : read_analysis_header, read_analysis_body
   use rockdda_io_counting, only : analysis_needs, fits_geometry, find_g0_points, g0_points_fit, plain_numbers
   use rockdda_io_record_reader, only : record_reader_type, append_in_order, note_comment, &
                                        report_decimal_comma, report_large_count
   use rockdda_io_numbers, only : is_whole
   use rockdda_io_source, only : source_type, read_source
   use rockdda_io_tokens, only : token_list_type, tokenise
   implicit none
   private
   public :: read_analysis_file, read_analysis_source

   !> Largest number of points tried for a file with mistyped numbers and without a geometry.
   integer, parameter :: most_tried_points = 50

contains

   !> Read and check an analysis file; every problem is added to `messages`, and a note with the dialect that
   !> was used. The result is valid only when no error was added.
   subroutine read_analysis_file(path, n_fixed, n_loading, forced_dialect, analysis, messages)
      character(len=*), intent(in) :: path
      integer, intent(in) :: n_fixed, n_loading   !! points of the model after cutting; < 0: unknown
      integer, intent(in) :: forced_dialect       !! one of dialect%...; auto: decide by counting
      type(analysis_input_type), intent(out) :: analysis
      type(diagnostics_type), intent(inout) :: messages
      type(source_type) :: source
      logical :: ok
      call read_source(path, source, messages, ok)
      if (ok) call read_analysis_source(source, n_fixed, n_loading, forced_dialect, analysis, messages)
   end subroutine read_analysis_file

   !> As read_analysis_file, from text in memory.
   subroutine read_analysis_source(source, n_fixed, n_loading, forced_dialect, analysis, messages)
      type(source_type), intent(in) :: source
      integer, intent(in) :: n_fixed, n_loading, forced_dialect
      type(analysis_input_type), intent(out) :: analysis
      type(diagnostics_type), intent(inout) :: messages
      type(token_list_type) :: tokens
      type(record_reader_type) :: reader
      type(diagnostics_type) :: found, strict_found
      real(wp), allocatable :: values(:)
      integer(i8) :: rest, needed
      integer :: n_points, counts(2), strict_counts(2), n_found, first, second, taken, p
      logical :: ok, both_fit

      call tokenise(source, tokens)
      if (tokens%n == 0) then
         call messages%add(severity%error, 'the file holds no numbers', tokens%end_origin())
         return
      end if
      call read_analysis_header(tokens, reader, analysis, counts, found, ok)
      if (.not. ok .and. fits_geometry(tokens)) then
         call messages%add(severity%error, 'the numbers fit a geometry file, not an analysis file: '// &
                           'are the files swapped?', tokens%end_origin())
         return
      else if (.not. ok .and. tokens%n_text > 0) then
         ! a word in the place of a count, on a line of its own?
         reader = record_reader_type(strict=.true.)
         call read_analysis_header(tokens, reader, analysis, strict_counts, strict_found, ok)
         counts = strict_counts
         if (ok .or. strict_found%n_errors <= found%n_errors) found = strict_found
      end if
      if (.not. ok) then
         call report_decimal_comma(tokens, found)
         call append_in_order(messages, found)
         return
      end if
      n_points = -1
      if (n_fixed >= 0 .and. n_loading >= 0) n_points = n_fixed + n_loading
      needed = analysis_needs(counts(1), counts(2))
      rest = tokens%n_numbers - needed
      values = plain_numbers(tokens)

      ! dialects that fit the count
      taken = dialect%auto
      p = n_points
      n_found = 0
      if (rest >= 0 .and. rest <= 1 .and. forced_dialect /= dialect%g0) taken = dialect%peer
      ! without points, one number more may be the SOR factor at the end or g0 behind g1
      both_fit = rest == 1 .and. n_points < 1 .and. forced_dialect == dialect%auto
      if (rest >= 1 .and. taken == dialect%auto .and. forced_dialect /= dialect%peer) then
         if (n_points < 0) then
            call find_g0_points(values, int(rest), n_found, first, second)
            if (n_found == 1) taken = dialect%g0
            p = first
         else if (g0_points_fit(values, int(rest), n_points)) then
            taken = dialect%g0
         end if
      end if

      if (taken /= dialect%auto) then
         call try(taken, p, .false., analysis, found, ok)
         if (both_fit) call choose_by_values()
         if (tokens%n_text > 0 .and. (found%has_errors() .or. .not. ok)) &
            call find_best_reading(ok, found%n_errors)
      else if (tokens%n_text > 0) then
         call find_best_reading(.false., huge(1))
         ok = taken /= dialect%auto
      else
         ok = .false.
      end if
      if (ok) then
         if (found%has_errors()) call report_decimal_comma(tokens, found)
         call append_in_order(messages, found)
         call report_dialect()
      else if (n_found > 1) then
         call messages%add(severity%error, 'the number of fixed and loading points does not follow from this file '// &
            'alone ('//to_string(first)//' and '//to_string(second)//' both fit): the geometry is needed', &
            tokens%end_origin())
      else
         ok = .true.
         if (tokens%n_text > 0) then
            ! a word in the place of a count, on a line of its own?
            reader = record_reader_type(strict=.true.)
            call read_analysis_header(tokens, reader, analysis, strict_counts, strict_found, ok)
         end if
         if (ok) then
            call report_decimal_comma(tokens, messages)
            call report_large_count(tokens, 3, 'number of block materials', counts(1), 13, messages)
            call report_large_count(tokens, 4, 'number of joint materials', counts(2), 3, messages)
            call report_count()
            if (tokens%n_text > 0) call note_comment(tokens, messages)
         else
            call append_in_order(messages, strict_found)
         end if
      end if

   contains

      !> Read the file in one dialect.
      subroutine try(way, points, strict, result, notes, exact)
         integer, intent(in) :: way, points             !! dialect, number of fixed and loading points
         logical, intent(in) :: strict
         type(analysis_input_type), intent(out) :: result
         type(diagnostics_type), intent(out) :: notes
         logical, intent(out) :: exact                  !! the file has exactly the numbers that were read
         type(record_reader_type) :: cursor
         integer :: nf, nl, numbers(2)
         nf = n_fixed
         nl = n_loading
         if (n_points < 0) then
            nf = max(0, points)
            nl = 0
         end if
         cursor%strict = strict
         call read_analysis_header(tokens, cursor, result, numbers, notes, exact)
         if (exact) call read_analysis_body(tokens, cursor, way, nf, nl, numbers, result, notes, exact)
      end subroutine try

      !> Both dialects fit: choose peer if all values satisfy its rules (read as peer, a file of dialect g0 has Young's
      !> modulus in place of Poisson's ratio), else g0 if they satisfy those of g0.
      subroutine choose_by_values()
         type(analysis_input_type) :: other
         type(diagnostics_type) :: other_found
         logical :: exact
         if (.not. ok .or. .not. found%has_errors()) return
         call try(dialect%g0, 0, .false., other, other_found, exact)
         if (.not. exact .or. other_found%has_errors()) return
         taken = dialect%g0
         p = 0
         analysis = other
         found = other_found
      end subroutine choose_by_values

      !> The file contains text, perhaps in place of numbers: choose the reading with the fewest errors.
      subroutine find_best_reading(known_ok, known_errors)
         logical, intent(in) :: known_ok                !! `analysis` and `found` hold a reading
         integer, intent(in) :: known_errors            !! its errors
         type(analysis_input_type) :: other
         type(diagnostics_type) :: other_found
         integer :: fewest, attempt, way, points, first_points, last_points
         logical :: exact
         fewest = huge(1)
         if (known_ok) fewest = known_errors
         do attempt = 1, 4
            way = merge(dialect%peer, dialect%g0, modulo(attempt, 2) == 1)
            if (forced_dialect /= dialect%auto .and. way /= forced_dialect) cycle
            first_points = n_points
            last_points = n_points
            if (n_points < 0) first_points = 0
            if (n_points < 0) last_points = merge(most_tried_points, 0, way == dialect%g0)
            do points = first_points, last_points
               call try(way, points, attempt > 2, other, other_found, exact)
               if (.not. exact .or. other_found%n_errors >= fewest) cycle
               fewest = other_found%n_errors
               taken = way
               p = points
               analysis = other
               found = other_found
               ok = .true.
            end do
         end do
      end subroutine find_best_reading

      !> Add the note with the dialect.
      subroutine report_dialect()
         character(len=:), allocatable :: text
         text = "read in dialect '"//trim(merge('peer', 'g0  ', taken == dialect%peer))//"'"
         if (forced_dialect /= dialect%auto) text = text//' as requested'
         text = text//': '//counted(tokens%n_numbers, 'number')
         if (taken == dialect%g0) text = text//', '//counted(p, 'fixed and loading point')
         if (both_fit .and. taken == dialect%peer) text = text// &
            ", the last is the SOR factor; they fit dialect 'g0' "// &
            "without fixed and loading points, too: --dialect g0 reads the number behind g1 as contact stiffness"
         if (both_fit .and. taken == dialect%g0) text = text//", no SOR factor; they fit dialect 'peer', too: "// &
            "--dialect peer reads the last number as SOR factor"
         call messages%add(severity%note, text, source%file_origin())
      end subroutine report_dialect

      !> No dialect fits: report the numbers that each needs.
      subroutine report_count()
         character(len=:), allocatable :: text
         integer(i8) :: rows
         text = 'found '//counted(tokens%n_numbers, 'number')//' for '//counted(counts(1), 'block material')// &
                ' and '//counted(counts(2), 'joint material')
         if (forced_dialect /= dialect%g0) text = text//"; dialect 'peer' needs "//to_string(needed)// &
                                                  ' (or '//to_string(needed + 1)//' with an SOR factor)'
         if (forced_dialect /= dialect%peer) then
            text = text//"; dialect 'g0' needs "
            if (n_points < 0) then
               text = text//to_string(needed + 2)//' + P + 3 rows (one less without SOR factor) for P fixed and '// &
                      'loading points, and no P fits'
            else
               rows = -1
               if (rest >= 1 + n_points) rows = rows_of_points()
               if (rows >= 0) then
                  text = text//to_string(needed + 2 + n_points + 3*rows)//' (or '// &
                         to_string(needed + 1 + n_points + 3*rows)//' without SOR factor) with '// &
                         to_string(rows)//' rows for '//counted(n_points, 'fixed and loading point')
               else
                  text = text//'at least '//to_string(needed + 1 + n_points)//' for '// &
                         counted(n_points, 'fixed and loading point')
               end if
            end if
         end if
         call messages%add(severity%error, text, tokens%end_origin())
      end subroutine report_count

      !> Rows of time-dependent values as counted in the file, -1 when the counts are not whole.
      integer(i8) function rows_of_points()
         integer :: k
         rows_of_points = -1
         if (size(values) < 7 + n_points) return
         do k = 8, 7 + n_points
            if (.not. is_whole(values(k)) .or. values(k) < 0) return
         end do
         rows_of_points = sum(nint(values(8:7 + n_points), i8))
      end function rows_of_points

   end subroutine read_analysis_source

end module rockdda_io_analysis_file
