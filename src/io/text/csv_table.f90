! SPDX-License-Identifier: MIT
!> Tables of numbers in text files: one row per line, separated by commas or blanks, with an optional header.
module rockdda_io_csv_table
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : lower_case, to_string
   use rockdda_base_diagnostics, only : diagnostics_type, severity
   use rockdda_io_row_reader, only : row_reader_type
   use rockdda_io_separators, only : settle_separators
   use rockdda_io_source, only : source_type, read_source
   use rockdda_io_tokens, only : token_list_type, tokenise
   implicit none
   private
   public :: read_csv_table

   !> Reading stops after this number of messages.
   integer, parameter :: most_errors = 1000
   !> Largest value accepted.
   real(wp), parameter :: largest_value = 1.0e60_wp

contains

   !> Read a table; the first column must not decrease (unless in_any_order). A header is
   !> optional; it must name all columns, in any order. Without a header they are in the order of `columns`.
   subroutine read_csv_table(path, columns, table, messages, in_any_order)
      character(len=*), intent(in) :: path
      character(len=*), intent(in) :: columns(:)       !! lower case, at most 16
      real(wp), allocatable, intent(out) :: table(:, :) !! (columns, rows)
      type(diagnostics_type), intent(inout), target :: messages
      logical, intent(in), optional :: in_any_order    !! true: the first column may decrease
      type(source_type) :: source
      type(token_list_type), target :: tokens
      type(row_reader_type) :: reader
      integer :: place(size(columns)), n, k
      logical :: ok, rising

      rising = .true.
      if (present(in_any_order)) rising = .not. in_any_order

      allocate (table(size(columns), 0))
      call read_source(path, source, messages, ok)
      if (ok) call settle_separators(source, size(columns), size(columns), messages, ok)
      if (.not. ok) return
      call tokenise(source, tokens)
      call reader%start(tokens, messages)
      place = [(k, k=1, size(columns))]
      if (len(reader%keyword()) > 0) then
         if (.not. tokens%is_not_finite(1)) call read_header(ok)
         if (.not. ok) return
      end if
      deallocate (table)
      allocate (table(size(columns), reader%n_rows - reader%at + 1))
      n = 0
      do while (reader%at <= reader%n_rows)
         if (messages%n_errors > most_errors) exit
         n = n + 1
         call reader%read_row('', columns, 'row '//to_string(n))
         if (.not. reader%row_ok .and. reader%row < reader%at - 1) reader%row = reader%at - 1
         if (len(reader%keyword()) > 0 .and. .not. reader%row_ok) reader%at = reader%at + 1
         table(:, n) = reader%value(place)
         if (.not. reader%row_ok) cycle
         do k = 1, size(columns)
            if (abs(reader%value(k)) > largest_value) call reader%fail(k, 'row '//to_string(n)// &
               ': must not be larger than '//to_string(largest_value))
         end do
         if (n == 1 .or. .not. rising) cycle
         if (table(1, n) < table(1, n - 1)) call reader%fail(place(1), trim(columns(1))//' of row '// &
            to_string(n)//': must not be smaller than in the row before')
      end do
      if (n == 0) call messages%add(severity%error, 'the table has no rows', tokens%end_origin())

   contains

      !> Find the position of each column.
      subroutine read_header(header_ok)
         logical, intent(out) :: header_ok
         character(len=:), allocatable :: name
         integer :: i, c, found
         header_ok = .true.
         place = 0
         found = 0
         do i = reader%first(1), reader%first(2) - 1
            name = lower_case(tokens%text(i))
            if (len(name) > 2) then
               if (name(1:1) == '"' .and. name(len(name):) == '"') name = name(2:len(name) - 1)
            end if
            do c = 1, size(columns)
               if (name == trim(columns(c)) .and. place(c) == 0) then
                  place(c) = i - reader%first(1) + 1
                  found = found + 1
               end if
            end do
         end do
         if (found < size(columns) .or. reader%first(2) - reader%first(1) /= size(columns)) then
            name = trim(columns(1))
            do c = 2, size(columns)
               name = name//','//trim(columns(c))
            end do
            call messages%add(severity%error, "the header must name the columns "//name//', whose '// &
                              "numbers are in the units of the model; found '"//words_of_row(1)//"'", &
                              tokens%origin(1))
            header_ok = .false.
         end if
         reader%at = 2
      end subroutine read_header

      !> The words of a row, with commas between them; of a long one the begin.
      function words_of_row(row) result(text)
         integer, intent(in) :: row
         character(len=:), allocatable :: text
         integer :: i
         text = tokens%text(reader%first(row))
         do i = reader%first(row) + 1, reader%first(row + 1) - 1
            text = text//','//tokens%text(i)
            if (len(text) > 60) exit
         end do
      end function words_of_row

   end subroutine read_csv_table

end module rockdda_io_csv_table
